"""Records come back from their documents as they were, and what does not fit is refused."""

import json
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.core.records import from_json, optional, read_json, record, to_json


@record
class Hole:
    kind: Literal["hole"] = "hole"
    width_mm: float


@record
class Whole:
    name: str
    flags: tuple[bool, ...]
    end: tuple[str | None, int]
    first: Hole | None
    cuts: tuple[Hole, ...]
    path: tuple[tuple[float, float], ...]
    note: str | None = optional(default=None)
    late: int | None = None


WHOLE_NUMBERS = st.integers(1 - 2**63, 2**63 - 1)
FLOATS = st.floats(allow_nan=False, allow_infinity=False)
HOLES = st.builds(Hole, width_mm=FLOATS)
WHOLES = st.builds(
    Whole,
    name=st.text(),
    flags=st.lists(st.booleans()).map(tuple),
    end=st.tuples(st.none() | st.text(), WHOLE_NUMBERS),
    first=st.none() | HOLES,
    cuts=st.lists(HOLES).map(tuple),
    path=st.lists(st.tuples(FLOATS, FLOATS)).map(tuple),
    note=st.none() | st.text(),
    late=st.none() | WHOLE_NUMBERS,
)


@given(WHOLES)
def test_what_is_written_is_read_again(whole):
    assert from_json(Whole, json.dumps(to_json(whole))) == whole


DOCUMENT = {
    "name": "A",
    "flags": [True],
    "end": [None, 3],
    "first": {"kind": "hole", "width_mm": 2.5},
    "cuts": [{"kind": "hole", "width_mm": 2.0}],
    "path": [[1.0, 2.0]],
    "note": "new",
    "late": None,
}


SPOILED = [
    ([], "Expected `object`, got `array`"),
    ({"name": 3}, "`$.name`"),
    ({"flags": [True, 1]}, "`$.flags[1]`"),
    ({"end": ["A"]}, "`$.end`"),
    ({"end": ["A", 3.5]}, "`$.end[1]`"),
    ({"end": ["A", True]}, "`$.end[1]`"),
    ({"first": {"kind": "slot", "width_mm": 1.0}}, "'slot' - at `$.first.kind`"),
    ({"first": {"kind": "hole"}}, "`width_mm` - at `$.first`"),
    ({"first": {"kind": "hole", "width_mm": float("nan")}}, "malformed"),
    ({"first": {"kind": "hole", "width_mm": "1e999"}}, "`$.first.width_mm`"),
    ({"cuts": [4]}, "`$.cuts[0]`"),
    ({"path": [[1.0, "x"]]}, "`$.path[0][1]`"),
    *(({name: None}, name) for name in sorted(set(DOCUMENT) - {"note", "late", "first"})),
]


@pytest.mark.parametrize(("change", "words"), SPOILED)
def test_what_does_not_fit_is_refused_with_its_place(change, words):
    document = DOCUMENT | change if isinstance(change, dict) else change
    with pytest.raises(InputError) as caught:
        from_json(Whole, json.dumps(document))
    assert words in str(caught.value)


def test_what_is_missing_is_named():
    for name in set(DOCUMENT) - {"note", "late"}:
        bare = {key: value for key, value in DOCUMENT.items() if key != name}
        with pytest.raises(InputError, match=f"`{name}`"):
            from_json(Whole, json.dumps(bare))


def test_a_file_that_is_no_record_is_named(tmp_path):
    def read(text):
        path = tmp_path / "hole.json"
        path.write_bytes(text)
        return read_json(path, lambda data: from_json(Hole, data), "hole", "hole.json")

    assert read(b'{"kind": "hole", "width_mm": 3.5}') == Hole(width_mm=3.5)
    for text in (b"{}", b"{", b"\xff", b"[" * 100_000, b'{"width_mm": 1e999}'):
        with pytest.raises(InputError, match=r"hole\.json"):
            read(text)
    with pytest.raises(InputError, match=r"none\.json"):
        read_json(tmp_path / "none.json", lambda document: document, "hole", "hole.json")
