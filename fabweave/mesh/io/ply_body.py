"""Read the body of a PLY file, element by element."""

import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import FloatArray, IntArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.mesh.io.number_rows import first_columns, float_numbers, row_lists
from fabweave.mesh.io.ply_head import Element
from fabweave.mesh.io.token_rows import Rows, text_rows

#: Codes of `struct` for numpy's type codes.
_STRUCT = {
    "i1": "b",
    "u1": "B",
    "i2": "h",
    "u2": "H",
    "i4": "i",
    "u4": "I",
    "i8": "q",
    "u8": "Q",
    "f4": "f",
    "f8": "d",
}


class TextBody:
    """A reader that walks through the rows of a text file."""

    def __init__(self, data: bytes, start: int, lines: int, name: str) -> None:
        """Split the body into rows; ``lines`` is how many lines the header has."""
        self._rows = text_rows(data[start:], name, first_line=lines + 1)
        self._position = 0

    def _take(self, element: Element) -> Rows:
        if not element.properties:
            return self._rows.cut(0, 0)
        first = self._position
        if first + element.number > len(self._rows):
            raise self._rows.fault(
                len(self._rows),
                f"only {len(self._rows) - first} of {element.number} rows of element "
                f"{element.name!r} are there",
            )
        self._position += element.number
        return self._rows.cut(first, self._position)

    def skip(self, element: Element) -> None:
        """Pass over an element."""
        self._take(element)

    def scalars(self, element: Element, columns: list[int]) -> FloatArray:
        """Return some scalar properties of an element, (N, columns)."""
        # Every property, a list too, takes a token or more.
        return first_columns(self._take(element), len(element.properties))[:, columns]

    def lists(self, element: Element, position: int) -> tuple[IntArray, IntArray]:
        """Return one list property of an element: the lengths, and all items in one array."""
        rows = self._take(element)
        starts = np.zeros(len(rows), dtype=np.int64)
        before = element.properties[:position]
        values = None
        for item in before:
            if item.count is None:
                starts += 1
                continue
            values = float_numbers(rows) if values is None else values
            inside = starts < rows.counts
            at = offsets_of(rows.counts)[:-1] + np.where(inside, starts, 0)
            with np.errstate(invalid="ignore"):
                length = np.where(inside, values[at], 0.0)
            known = inside & (length >= 0) & (length < rows.counts)  # false for "not a number"
            starts = np.where(
                known, starts + 1 + np.where(known, length, 0).astype(np.int64), rows.counts
            )
        return row_lists(rows, starts)


class BinaryBody:
    """A reader that walks through the bytes of a binary file."""

    def __init__(self, data: bytes, start: int, order: str, name: str) -> None:
        """Start at byte ``start``, with numpy's mark for the byte order."""
        self._data = data
        self._position = start
        self._order = order
        self._name = name

    def _short(self, element: Element, number: int) -> InputError:
        return InputError(
            f"{self._name}, byte {self._position}: the file ends in row {number} of "
            f"{element.number} of element {element.name!r}, or the length of a list in it is wrong"
        )

    def _records(self, element: Element, lengths: list[int]) -> npt.NDArray[Any] | None:
        """View all rows at once as records with these list lengths, where that fits."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        for number, item in enumerate(element.properties):
            if item.count is None:
                fields.append((f"p{number}", self._order + item.kind))
            else:
                fields.append((f"n{number}", self._order + item.count))
                fields.append((f"p{number}", self._order + item.kind, (lengths[number],)))
        kind = np.dtype(fields)
        if kind.itemsize * element.number > len(self._data) - self._position:
            return None
        return np.frombuffer(self._data, kind, count=element.number, offset=self._position)

    def scalars(self, element: Element, columns: list[int]) -> FloatArray:
        """Return some scalar properties of an element, (N, columns)."""
        if any(item.count is not None for item in element.properties):
            starts = self._walk(element, 0, whole_rows=True)[0]
            width = max(columns) + 1
            kind = np.dtype(
                [(f"p{n}", self._order + p.kind) for n, p in enumerate(element.properties[:width])]
            )
            records = self._gather(starts, np.ones_like(starts), kind)
        else:
            if not element.number:
                return np.zeros((0, len(columns)))
            all_records = self._records(element, [0] * len(element.properties))
            if all_records is None:
                raise self._short(element, element.number - 1)
            records = all_records
            self._position += records.nbytes
        with np.errstate(invalid="ignore"):  # a signalling "not a number" is left to the mesh check
            return np.column_stack([records[f"p{column}"].astype(np.float64) for column in columns])

    def lists(self, element: Element, position: int) -> tuple[IntArray, IntArray]:
        """Return one list property of an element: the lengths, and all items in one array."""
        item = element.properties[position]
        kind = np.dtype(self._order + item.kind)
        only = sum(other.count is not None for other in element.properties) == 1
        if only and element.number:
            # Most files have faces of one size: take the first one's and see.
            count = self._first_count(element, position)
            lengths = [count] * len(element.properties)
            records = self._records(element, lengths)
            if records is not None and np.all(records[f"n{position}"] == count):
                self._position += records.nbytes
                counts = np.full(element.number, count, dtype=np.int64)
                return counts, records[f"p{position}"].astype(np.int64).reshape(-1)
        starts, counts = self._walk(element, position)
        return counts, self._gather(starts, counts, kind).astype(np.int64)

    def _first_count(self, element: Element, position: int) -> int:
        before = sum(int(item.kind[1:]) for item in element.properties[:position])
        code = self._order + _STRUCT[element.properties[position].count or "u1"]
        try:
            count = int(struct.unpack_from(code, self._data, self._position + before)[0])
        except struct.error:
            raise self._short(element, 0) from None
        if not 0 <= count <= len(self._data):
            raise self._short(element, 0)
        return count

    def skip(self, element: Element) -> None:
        """Pass over an element."""
        if any(item.count is not None for item in element.properties):
            self._walk(element, 0)
            return
        size = sum(int(item.kind[1:]) for item in element.properties) * element.number
        if size > len(self._data) - self._position:
            raise self._short(element, element.number - 1)
        self._position += size

    def _walk(
        self, element: Element, wanted: int, *, whole_rows: bool = False
    ) -> tuple[IntArray, IntArray]:
        """Walk from row to row, since each one's place depends on those before it.

        Returns
        -------
        starts, counts : (N,) int arrays
            First byte and length of the wanted list of each row (or the first byte of the row).
        """
        steps = [
            (int(item.kind[1:]), None)
            if item.count is None
            else (int(item.kind[1:]), struct.Struct(self._order + _STRUCT[item.count]))
            for item in element.properties
        ]
        starts, counts = [], []
        at, data, end = self._position, self._data, len(self._data)
        for number in range(element.number):
            if whole_rows:
                starts.append(at)
            for position, (size, counter) in enumerate(steps):
                if counter is None:
                    at += size
                    continue
                if at + counter.size > end:
                    raise self._short(element, number)
                count = counter.unpack_from(data, at)[0]
                at += counter.size
                if count < 0 or count * size > end - at:
                    raise self._short(element, number)
                if position == wanted and not whole_rows:
                    starts.append(at)
                    counts.append(count)
                at += count * size
        if at > end:
            raise self._short(element, element.number - 1)
        self._position = at
        return np.array(starts, dtype=np.int64), np.array(counts, dtype=np.int64)

    def _gather(self, starts: IntArray, counts: IntArray, kind: np.dtype[Any]) -> npt.NDArray[Any]:
        """Collect runs of items that start at any bytes."""
        size = kind.itemsize
        offsets = offsets_of(counts)
        places = np.repeat(starts - offsets[:-1] * size, counts) + np.arange(offsets[-1]) * size
        flat = np.frombuffer(self._data, dtype=np.uint8)
        return flat[places[:, None] + np.arange(size)].view(kind).reshape(-1)
