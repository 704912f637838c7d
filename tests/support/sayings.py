"""What the package can say: a pattern for each text in its source, open where values go."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "fabweave"
#: Texts with fewer letters of their own would match too much.
_LEAST = 14
_FILLED = ".*?"
#: As ``fabweave.core.messages.agree`` has them: a number, and words that agree with it.
_AGREEING = re.compile(r"(\{n\}|\[[^|\[\]]*\|[^|\[\]]*\])")


def sayable(message: str) -> bool:
    """Return whether a message, or a line of one, is a text of the package's source."""
    return any(pattern.fullmatch(message) for pattern in _patterns())


@cache
def _patterns() -> tuple[re.Pattern[str], ...]:
    trees = (ast.parse(path.read_text("utf-8")) for path in sorted(PACKAGE.rglob("*.py")))
    found = {
        line
        for tree in trees
        for node in ast.walk(tree)
        if isinstance(node, ast.JoinedStr | ast.Constant | ast.BinOp)
        for line in _pattern(node).split("\\\n")
        if len(re.sub(r"\W", "", line.replace(_FILLED, ""))) >= _LEAST
    }
    return tuple(map(re.compile, sorted(found)))


def _pattern(node: ast.expr) -> str:
    """Return a regular expression for what a piece of code comes to, as far as it is a text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return "".join(_literal(node.value))
    if isinstance(node, ast.JoinedStr):
        return "".join(map(_pattern, node.values))
    if isinstance(node, ast.FormattedValue):
        return _pattern(node.value)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _pattern(node.left) + _pattern(node.right)
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "agree":
        return _pattern(node.args[1])
    return _FILLED


def _literal(text: str) -> Iterator[str]:
    for part in _AGREEING.split(text):
        if part == "{n}":
            yield r"\d+"
        elif part.startswith("[") and _AGREEING.fullmatch(part):
            one, many = part[1:-1].split("|")
            yield f"(?:{re.escape(one)}|{re.escape(many)})"
        else:
            yield re.escape(part)
