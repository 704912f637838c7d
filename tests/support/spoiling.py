"""Spoil what a job says, one fact at a time: edits for tables of (path, change, check)."""

import json
import re


def _reach(document, path):
    """Follow keys, numbers, and functions that find something."""
    for step in path:
        document = step(document) if callable(step) else document[step]
    return document


def _named(edit, *words):
    edit.__name__ = " ".join(getattr(word, "__name__", None) or str(word) for word in words)
    return edit


def put(*path_and_value):
    """Return an edit that sets a value deep in a document; a function is given the old one."""
    *path, last, value = path_and_value

    def edit(document):
        at = _reach(document, path)
        at[last] = value(at[last]) if callable(value) else value

    return _named(edit, *path_and_value)


def drop(*path):
    """Return an edit that deletes something deep in a document."""

    def edit(document):
        del _reach(document, path[:-1])[path[-1]]

    return _named(edit, "drop", *path)


def exchange(*path):
    """Return an edit that exchanges the two entries that the path ends with."""
    *path, one, two = path

    def edit(document):
        at = _reach(document, path)
        at[one], at[two] = at[two], at[one]

    return _named(edit, "exchange", *path, one, two)


def more(by):
    """Return a function that adds so much."""
    return _named(lambda value: value + by, f"+ {by}")


def flip(value):
    return not value


def edit_json(path, *changes):
    """Change a JSON file by such edits, and return what it says now."""
    document = json.loads(path.read_text("utf-8"))
    for change in changes:
        change(document)
    path.write_text(json.dumps(document), "utf-8")
    return document


def edit_text(path, old, new):
    """Replace the first match of a pattern, which there must be, in a file."""
    text = path.read_text("utf-8")
    assert re.search(old, text), old
    path.write_text(re.sub(old, new, text, count=1), "utf-8", newline="\n")


def swap(old, new):
    """Return an edit of a text that must find what it replaces, once."""

    def edit(text):
        assert old in text, old
        return text.replace(old, new, 1)

    return _named(edit, f"{old!r:.24} to {new!r:.24}")
