"""The site leads nowhere in vain, and loads nothing from elsewhere."""

import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

TOOL = Path(__file__).parent / "tools" / "make_site.py"
#: What a page loads by itself, and what it only leads to.
LOADED = {("img", "src"), ("script", "src"), ("link", "href"), ("iframe", "src"), ("source", "src")}
LEADS = {("a", "href")}


class Links(HTMLParser):
    """Collects what a page loads, and where it leads."""

    def __init__(self, text):
        super().__init__()
        self.loaded, self.leads = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if value and (tag, name) in LOADED and ("rel", "canonical") not in attributes:
                self.loaded.append(value)
            if value and (tag, name) in LEADS:
                self.leads.append(value)


def faults(page, text):
    """Return what is wrong with the links of a page, which stands in a folder."""
    links, wrong = Links(text), []
    for link in (*links.loaded, *links.leads):
        parts = urlsplit(link)
        if parts.scheme == "data" or (not parts.path and not parts.netloc):
            continue
        if parts.scheme or parts.netloc:
            wrong += [f"loads {link}"] * (link in links.loaded)
        elif not parts.path.startswith("/") and not (page.parent / unquote(parts.path)).exists():
            wrong.append(f"leads to {link}")
    return wrong


def test_a_link_in_vain_and_one_from_elsewhere_are_found(tmp_path):
    page = tmp_path / "a.html"
    page.touch()
    sound = '<a href="a.html#x">a</a><a href="https://example.org">b</a><img src="data:,">'
    assert faults(page, sound) == []
    for wrong in ('<img src="https://example.org/a.png">', '<a href="b.html">b</a>',
                  '<script src="//example.org/a.js"></script>', '<link href="b.css">'):  # fmt: skip
        assert len(faults(page, sound + wrong)) == 1


@pytest.mark.slow
def test_the_site_is_whole(tmp_path):
    pytest.importorskip("mkdocs", reason="what builds the site is absent: make site installs it")
    pytest.importorskip("mkdocstrings", reason="what builds the site is absent")
    command = [sys.executable, str(TOOL), str(tmp_path / "site")]
    subprocess.run(command, check=True, capture_output=True)
    pages = sorted((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 30
    assert (tmp_path / "site" / "outputs" / "torus" / "assembly.html") in pages
    wrong = {str(page): faults(page, page.read_text("utf-8")) for page in pages}
    # That page is shown at any address, and says where it is from its root.
    assert {name: found for name, found in wrong.items() if found and "404" not in name} == {}
