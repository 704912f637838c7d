"""What the notes say of letters and joints, in words that fit their numbers."""

from dataclasses import replace

import numpy as np
import pytest
from assembly_models import model_of

from fabweave.cut.labels.marks import Marks
from fabweave.cut.labels.texts import Label, Missing
from fabweave.report.notes import _label_notes, joint_notes


def marks(heights_mm, dropped):
    """Return the marks of a piece: partners lettered so high, and kinds that had no room."""
    labels = tuple(
        Label("B1", ("partner",), 0, height, np.zeros(2), 0.0, (5.0, height), ())
        for height in heights_mm
    )
    return Marks(labels, (), tuple(Missing(kind, "B1", 0) for kind in dropped))


@pytest.mark.parametrize(
    ("pieces", "notes"),
    [
        ([marks([2.5, 3.0], [])], []),
        (
            [marks([2.0, 2.5], []), marks([2.5], ["sign"])],
            [
                "letters: of 3 partners at crossings, 1 is smaller than 2.5 mm; "
                "of 1 signs for over and under, 1 had no room (crossing_map.json lists them)"
            ],
        ),
        (
            [marks([2.0, 2.0, 2.5], ["partner", "partner"])],
            [
                "letters: of 5 partners at crossings, 2 are smaller than 2.5 mm and 2 had no room "
                "(crossing_map.json lists them)"
            ],
        ),
    ],
)
def test_small_and_missing_letters_are_counted(pieces, notes):
    assert _label_notes(pieces) == notes


def joints_note(kind, count):
    """Return the note of a job with only the first few of its joints."""
    made = model_of("shape:octahedron", joint=kind).made
    few = replace(made, joints=made.joints[:count])
    return joint_notes(few, 200.0)


@pytest.mark.parametrize(
    ("kind", "count", "words"),
    [
        ("rivet", 1, "joints: 1 lap with 1 fastener"),
        ("rivet", 3, "joints: 3 laps with 1 fastener each"),
        ("slot", 1, "joints: 1 tab pushed through a slot up to its shoulders"),
        ("slot", 2, "joints: 2 tabs pushed through a slot up to their shoulders"),
        ("none", 2, "joints: 2 seams end to end, taped on the inside"),
    ],
)
def test_joints_are_counted_by_their_kinds(kind, count, words):
    assert joints_note(kind, count) == [words]


def test_without_joints_there_is_no_note():
    assert joints_note("rivet", 0) == []
