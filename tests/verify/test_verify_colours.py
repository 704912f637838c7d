"""Spoil the colours of the model: the check of them objects."""

import numpy as np
import pytest
from verify_writers import glb_bytes, paint

from fabweave.verify import verify_job
from fabweave.verify.measure.colours import lab_of, light_of_words


def failed(folder):
    return set(verify_job(folder).failed)


def repainted(word, number=0):
    """Return an edit of a model that gives a thread another colour."""

    def edit(document):
        document["materials"][number] = paint(word)

    return edit


def same_as_the_first(document):
    """Give all threads the first one's colour."""
    for material in document["materials"]:
        material.update(document["materials"][0])


def hardly_another(document):
    """Give all threads colours that nobody tells apart."""
    for number in range(len(document["materials"])):
        document["materials"][number] = paint(f"#5070{0x90 + 2 * number:02x}")


@pytest.mark.parametrize("edit", [same_as_the_first, hardly_another])
def test_strands_of_one_colour_are_found(job, specimen, edit):
    folder = job()
    (folder / "model.glb").write_bytes(glb_bytes(specimen("octahedron").strips, edit=edit))
    # The viewer has the colours that were there before.
    assert failed(folder) == {"colours", "viewer"}
    (folder / "job.toml").write_text(
        (folder / "job.toml").read_text() + '[job]\ncolours = "hue-circle"\n'
    )
    assert failed(folder) == {"viewer"}


def test_another_colour_than_in_the_viewer_is_found_in_the_viewer(job, specimen):
    folder = job()
    edit = repainted("#123456")
    (folder / "model.glb").write_bytes(glb_bytes(specimen("octahedron").strips, edit=edit))
    assert failed(folder) == {"viewer"}


def test_differences_are_those_of_cielab():
    lab = lab_of(light_of_words(["#ffffff", "#000000", "#ff0000", "#0000ff", "#808080"]))
    assert np.allclose(
        lab,
        [[100, 0, 0], [0, 0, 0], [53.24, 80.09, 67.20], [32.30, 79.19, -107.86], [53.59, 0, 0]],
        atol=0.05,
    )
