"""Have the README work on an index: its links and pictures lead to where the project is at home.

The environment says where that is, as ``FABWEAVE_HOME=https://…/fabweave``. Where it says nothing,
pictures are left out, and links are their words: nothing on the page is broken.
"""

import os
import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

#: A picture or a link that leads into the repository.
_RELATIVE = re.compile(r"(!?)\[([^\]]*)\]\((?!https?://|#)([^)\s]+)\)")


def for_index(text: str, home: str, version: str) -> str:
    """Return the README as an index shows it."""

    def absolute(match: re.Match[str]) -> str:
        picture, words, path = match.groups()
        if not home:
            return "" if picture else words
        return f"{picture}[{words}]({home}/{'raw' if picture else 'blob'}/v{version}/{path})"

    return re.sub(r"\n{3,}", "\n\n", _RELATIVE.sub(absolute, text))


class IndexHook(MetadataHookInterface):
    """Adds the README, and the project's addresses where they are known."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add both to the metadata of a wheel or an sdist."""
        home, version = os.environ.get("FABWEAVE_HOME", "").rstrip("/"), metadata["version"]
        readme = Path(self.root, "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {
            "content-type": "text/markdown", "text": for_index(readme, home, version),
        }  # fmt: skip
        if home:
            pages = {"Issues": "issues", "Changelog": f"blob/v{version}/CHANGELOG.md"}
            metadata["urls"] = {"Homepage": home} | {
                name: f"{home}/{page}" for name, page in pages.items()
            }
