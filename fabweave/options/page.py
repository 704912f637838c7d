"""Write the reference of all options."""

import textwrap

from fabweave.options.option import SECTIONS, Option
from fabweave.options.table import OPTIONS

_WIDE = 100
_HEAD = """\
# Options

What `fabweave make` takes. Those that change the mesh, the weave or the ribbons are also options of
`fabweave inspect` and `fabweave model`. A length is a number and a unit (`mm`, `cm`, `m`, `um`,
`in`, `ft`); a plain number counts millimetres. In `job.toml`, and as arguments in Python, options
have underscores for hyphens; the fields of `Settings` hold their values, lengths as numbers.
"""


def options_page() -> str:
    """Return the reference of all options as Markdown: by sections, as help has them.

    Examples
    --------
    >>> "### `--manual-paper [a4|letter]`" in options_page().partition("## Machine")[2]
    True
    """
    parts = [_HEAD]
    for section in SECTIONS:
        parts.append(f"## {section}\n")
        parts += [_entry(option) for option in OPTIONS if option.section == section]
    return "\n".join(parts)


def _entry(option: Option) -> str:
    """Return the entry of one option."""
    kind = option.kind
    text = textwrap.fill(option.text, _WIDE, break_on_hyphens=False, break_long_words=False)
    facts = ["takes no value" if kind.flag else f"takes {kind.told}"]
    if kind.unit:
        facts.append(f"unit: {kind.unit}")
    if option.usual:
        facts.append(f"default: {option.usual}")
    if kind.repeatable:
        facts.append("may be repeated")
    if option.making:
        facts.append("for `fabweave make` only")
    facts.append(f"`Settings.{option.field}`")
    return "\n".join([f"### `{option.shown}`", "", text, "", *(f"- {fact}" for fact in facts), ""])
