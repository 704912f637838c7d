"""Put the scripts of a page together, as pages that are opened from a folder load no modules."""

import re
from importlib import resources
from posixpath import dirname, join, normpath

#: What is said of functions and types is for those who read the package.
_DOC = re.compile(r"^ */\*\*.*?\*/\n", re.MULTILINE | re.DOTALL)
#: What our modules begin with: names, or all of a module under one name.
_IMPORT = re.compile(r'^import (?:\* as )?(\w+|\{[^}]*\}) from "(\.[^"]*)";$', re.MULTILINE)
#: What they export, one name each.
_EXPORT = re.compile(r"^export (?=(?:class|const|function) (\w+))", re.MULTILINE)


def bundled(entry: str) -> str:
    """Return a module of the package and all that it imports, as one script.

    Each module becomes a function that returns what it exports, after those that it imports.

    Parameters
    ----------
    entry : str
        Where it is in the package, such as ``studio/page/widget.js``. What it exports is
        ``modules[entry]`` in the script.
    """
    made: dict[str, str] = {}

    def add(name: str) -> None:
        text = _DOC.sub("", resources.files("fabweave").joinpath(name).read_text("utf-8"))

        def imported(found: re.Match[str]) -> str:
            names, other = found[1], normpath(join(dirname(name), found[2]))
            if other not in made:
                add(other)
            return f'const {names.replace(" as ", ": ")} = modules["{other}"];'

        body, names = _IMPORT.sub(imported, text), ", ".join(_EXPORT.findall(text))
        body = _EXPORT.sub("", body)
        made[name] = f'modules["{name}"] = (() => {{\n{body}return {{ {names} }};\n}})();'

    add(entry)
    return "\n".join(["const modules = {};", *made.values()])
