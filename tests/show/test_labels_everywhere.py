"""Pieces bear the names that the map gives them: read from their strokes, without a font."""

import json
import re
import shutil

import pytest
from read_letters import alike, letters_of

from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally

pytestmark = pytest.mark.slow

PIECE, JOINT = re.compile(r"\b[A-Z]+\d+\b"), re.compile(r"#(\d+)")


@pytest.fixture(scope="module")
def folder(finished):
    return finished("shape:torus?m=8&n=4", "--size", "300mm", "--effort", "quick")


def lettering(folder, kind):
    """Return the words that are engraved on each piece, read from one format's strokes.

    The letters are learnt from the other half of the pieces, in the other format.
    """
    job, words = load_job(folder, Tally("files")), {}
    plan = json.loads((folder / "crossing_map.json").read_text())
    labels = {piece["id"]: piece["labels"] for piece in plan["pieces"]}
    drawings, others = (
        {at: drawn[sheet.name] for at, sheet in enumerate(job.map.sheets, start=1)}
        for drawn in ((job.sheets.dxf, job.sheets.svg)[:: 1 if kind == "dxf" else -1])
    )
    for half in (0, 1):
        taught = {}
        for piece in job.map.pieces[1 - half :: 2]:
            for text, letters in letters_of(piece, labels[piece.id], others[piece.sheet]):
                taught.update(zip(text, letters, strict=False))
        for piece in job.map.pieces[half::2]:
            words[piece.id] = [
                "".join(
                    next((sign for sign, looks in taught.items() if alike(looks, letter)), "?")
                    for letter in letters
                )
                for _, letters in letters_of(piece, labels[piece.id], drawings[piece.sheet])
            ]
    return words


def map_names(folder):
    plan = json.loads((folder / "crossing_map.json").read_text())
    return {
        "pieces": {piece["id"] for piece in plan["pieces"]},
        "joints": {str(joint["id"]) for joint in plan["joints"]},
        "sheets": {sheet["name"] for sheet in plan["sheets"]},
    }


def drawing_names(folder, kind):
    words = lettering(folder, kind)
    said = [word for own in words.values() for word in own]
    # What a piece says of others are names, too.
    assert set(PIECE.findall(" ".join(said).replace("→", " "))) <= set(words)
    return {
        # Each piece says its own name.
        "pieces": {key for key, own in words.items() if any(f"{key}→" in word for word in own)},
        "joints": {key for word in said for key in JOINT.findall(word)},
        "sheets": {path.stem for path in (folder / "sheets").glob(f"*.{kind}")},
    }


@pytest.mark.parametrize("kind", ["dxf", "svg"])
def test_pieces_bear_the_names_of_the_map_and_letters_of_another_are_noticed(
    folder, tmp_path, kind
):
    assert all(map_names(folder).values())
    assert drawing_names(folder, kind) == map_names(folder)
    plan = json.loads((folder / "crossing_map.json").read_text())
    threads = {thread["label"] for thread in plan["threads"]}
    assert {piece["id"].rstrip("0123456789") for piece in plan["pieces"]} == threads
    shutil.copytree(folder, tmp_path / "job")
    # The map exchanges the names of two pieces; the strokes say what they said.
    names = {piece["id"]: piece for piece in plan["pieces"]}
    one, other = names["A1"], names["B1"]
    one["id"], other["id"] = "B1", "A1"
    (tmp_path / "job" / "crossing_map.json").write_text(json.dumps(plan))
    assert drawing_names(tmp_path / "job", kind) != map_names(tmp_path / "job")
