"""Build the site of README, guide, gallery, finished jobs and reference: `make site`.

The pages stand as they do in the repository, so that their links hold; mkdocs objects to any that
does not. Nothing is loaded from elsewhere. Needs the extra `site`.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from fabweave.cli.guide import TOPICS, options_page, page

ROOT = Path(__file__).parents[2]
#: What the site has of the repository, folders whole.
SHOWN = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "LICENSE", "CITATION.cff",
         "examples", "outputs")  # fmt: skip
#: The reference: everything that `import fabweave as fw` opens, out of its docstrings.
REFERENCE = "# Reference\n\nWhat `import fabweave as fw` opens.\n\n" + "\n".join(
    f"::: fabweave.front_door.{name}"
    for name in ("make", "batch", "design", "inspect", "verify", "read", "mesh", "shape", "weave",
                 "Mesh", "Weave", "Ribbons", "Pieces", "Layout", "Yarns", "WrittenJob", "Design",
                 "WrittenBatch", "Inspection")
)  # fmt: skip


def title_of(text: str) -> str:
    """Return what a page is called."""
    return text.partition("\n")[0].removeprefix("# ")


def main(target: Path) -> None:
    """Gather the pages, and have mkdocs build them into a folder."""
    with tempfile.TemporaryDirectory(prefix="fabweave-site-") as folder:
        docs = Path(folder) / "docs"
        for name in SHOWN:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, docs / name)
            else:
                docs.mkdir(exist_ok=True)
                shutil.copy(source, docs / name)
        shutil.copytree(ROOT / "fabweave" / "guide", docs / "fabweave" / "guide")
        options = "fabweave/guide/options.md"
        (docs / options).write_text(options_page(), encoding="utf-8")
        (docs / "reference.md").write_text(REFERENCE, encoding="utf-8")
        config = {
            "site_name": "fabweave",
            "docs_dir": str(docs),
            "site_dir": str(target.resolve()),
            "use_directory_urls": False,
            # Fonts and icons are those of the system and of the theme: nothing is fetched.
            "theme": {"name": "material", "font": False, "features": ["navigation.tabs"]},
            "plugins": [
                "search",
                {"mkdocstrings": {"handlers": {"python": {"paths": [str(ROOT)], "options": {
                    "docstring_style": "numpy", "show_source": False, "heading_level": 2,
                    "show_root_heading": True, "show_root_full_path": False,
                }}}}},
            ],
            "markdown_extensions": ["tables", "admonition", "toc", "pymdownx.superfences"],
            "nav": [
                {"fabweave": "README.md"},
                {"Guide": [
                    *({title_of(page(name)): f"fabweave/guide/{name}.md"} for name in TOPICS),
                    {"Options": options},
                ]},
                {"Gallery": "examples/gallery/README.md"},
                {"Finished jobs": "outputs/README.md"},
                {"The paper beside us": "examples/figures/README.md"},
                {"Reference": "reference.md"},
                {"Changes": "CHANGELOG.md"},
                {"Contributing": "CONTRIBUTING.md"},
            ],
            "validation": {"nav": {"omitted_files": "info"}, "links": {"anchors": "info"}},
        }  # fmt: skip
        path = Path(folder) / "mkdocs.yml"
        import yaml  # noqa: PLC0415 - comes with mkdocs

        path.write_text(yaml.safe_dump(config, sort_keys=False), encoding="utf-8")
        command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-f", str(path)]
        subprocess.run(command, check=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
