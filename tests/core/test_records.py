"""Records come back from their documents as they were, and what does not fit is refused."""

import json
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.core.records import from_json, inline, key, optional, read_json, record, to_json


@record
class Hole:
    kind: Literal["hole"] = "hole"
    width_mm: float = key("width")


@record
class Slot:
    kind: Literal["slot"] = "slot"
    path: tuple[tuple[float, float], ...]


@record
class Sums:
    count: int
    area: float | None


@record
class Whole:
    name: str
    flags: tuple[bool, ...]
    end: tuple[str | None, int]
    first: Hole | None
    cuts: tuple[Hole | Slot, ...]
    sums: Sums = inline()
    note: str | None = optional(default=None)
    late: int | None = None


WHOLE_NUMBERS = st.integers(1 - 2**63, 2**63 - 1)
FLOATS = st.floats(allow_nan=False, allow_infinity=False)
HOLES = st.builds(Hole, width_mm=FLOATS)
SLOTS = st.builds(Slot, path=st.lists(st.tuples(FLOATS, FLOATS)).map(tuple))
WHOLES = st.builds(
    Whole,
    name=st.text(),
    flags=st.lists(st.booleans()).map(tuple),
    end=st.tuples(st.none() | st.text(), WHOLE_NUMBERS),
    first=st.none() | HOLES,
    cuts=st.lists(HOLES | SLOTS).map(tuple),
    sums=st.builds(Sums, count=WHOLE_NUMBERS, area=st.none() | FLOATS),
    note=st.none() | st.text(),
    late=st.none() | WHOLE_NUMBERS,
)


@given(WHOLES)
def test_what_is_written_is_read_again(whole):
    assert from_json(Whole, json.loads(json.dumps(to_json(whole)))) == whole


DOCUMENT = {
    "name": "A",
    "flags": [True],
    "end": [None, 3],
    "first": {"kind": "hole", "width": 2.5},
    "cuts": [{"kind": "slot", "path": [[1.0, 2.0]]}, {"kind": "hole", "width": 2}],
    "count": 4,
    "area": None,
    "note": "new",
    "late": None,
}


def test_a_document_has_the_keys_of_its_records_in_their_order():
    whole = from_json(Whole, DOCUMENT)
    assert whole.cuts == (Slot(path=((1.0, 2.0),)), Hole(width_mm=2))
    assert whole.sums == Sums(count=4, area=None)
    assert json.dumps(to_json(whole)) == json.dumps(DOCUMENT)


def test_what_may_be_absent():
    bare = {name: value for name, value in DOCUMENT.items() if name not in ("note", "late")}
    whole = from_json(Whole, bare | {"of a later version": 5})
    assert (whole.note, whole.late) == (None, None)
    assert to_json(whole) == bare | {"late": None}


SPOILED = [
    ([], "the document is []"),
    ({"name": 3}, "name is 3"),
    ({"flags": [True, 1]}, "flags[1] is 1"),
    ({"end": ["A"]}, "end has 1 values"),
    ({"end": ["A", 3.0]}, "end[1] is 3.0"),
    ({"end": ["A", True]}, "end[1] is True"),
    ({"first": {"kind": "slot", "width": 1.0}}, "first.kind is 'slot'"),
    ({"first": {"kind": "hole"}}, "first has no 'width'"),
    ({"first": {"kind": "hole", "width": float("nan")}}, "first.width is nan"),
    ({"cuts": [{"width": 1.0}]}, "cuts[0] has no 'kind'"),
    ({"cuts": [4]}, "cuts[0] is 4"),
    ({"cuts": [{"kind": "slot", "path": [[1.0, "x"]]}]}, "cuts[0].path[0][1] is 'x'"),
    *(({name: None}, name) for name in sorted(set(DOCUMENT) - {"note", "late", "first", "area"})),
]


@pytest.mark.parametrize(("change", "words"), SPOILED)
def test_what_does_not_fit_is_refused_with_its_place(change, words):
    with pytest.raises(InputError) as caught:
        from_json(Whole, DOCUMENT | change if isinstance(change, dict) else change)
    assert str(caught.value).startswith(words)


def test_what_is_missing_is_named():
    for name in set(DOCUMENT) - {"note", "late"}:
        with pytest.raises(InputError, match=f"no '{name}'"):
            from_json(Whole, {key: value for key, value in DOCUMENT.items() if key != name})


def test_a_file_that_is_no_record_is_named(tmp_path):
    def read(text):
        path = tmp_path / "hole.json"
        path.write_bytes(text)
        return read_json(path, lambda document: from_json(Hole, document), "hole", "hole.json")

    assert read(b'{"kind": "hole", "width": 3.5}') == Hole(width_mm=3.5)
    for text in (b"{}", b"{", b"\xff", b"[" * 100_000):
        with pytest.raises(InputError, match=r"hole\.json"):
            read(text)
    with pytest.raises(InputError, match=r"none\.json"):
        read_json(tmp_path / "none.json", lambda document: document, "hole", "hole.json")
