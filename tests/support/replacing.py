"""Change fields of what is read of a job, whichever sort of record it is."""

import dataclasses

import msgspec


def replace(record, **changes):
    """Return a copy of a dataclass or msgspec record with other values."""
    copy = msgspec.structs if isinstance(record, msgspec.Struct) else dataclasses
    return copy.replace(record, **changes)
