"""Pieces, joints, threads and sheets have the same names in every file, and on the pieces."""

import csv
import io
import json
import re
import shutil

import pypdf
import pytest
from read_letters import alike, letters_of
from viewer_scene import page_data

from fabweave.job import run_job
from fabweave.options.settings import Settings
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally

PIECE, JOINT = re.compile(r"\b[A-Z]+\d+\b"), re.compile(r"#(\d+)")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("labels") / "job"
    run_job(Settings.of("shape:torus?m=8&n=4", size_mm=300.0, effort="quick"), path)
    return path


def lettering(folder, kind):
    """Return the words that are engraved on each piece, read from one format's strokes.

    The letters are learnt from the other half of the pieces, in the other format.
    """
    job, words = load_job(folder, Tally("files")), {}
    plan = json.loads((folder / "crossing_map.json").read_text())
    labels = {piece["id"]: piece["labels"] for piece in plan["pieces"]}
    drawings, others = (job.dxf, job.svg) if kind == "dxf" else (job.svg, job.dxf)
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


def plan_names(plan):
    return {
        "pieces": {piece["id"] for piece in plan["pieces"]},
        "joints": {str(joint["id"]) for joint in plan["joints"]},
        "threads": {thread["label"] for thread in plan["threads"]},
        "sheets": {sheet["name"] for sheet in plan["sheets"]},
    }


def map_names(folder):
    return plan_names(json.loads((folder / "crossing_map.json").read_text()))


def viewer_names(folder):
    return plan_names(page_data((folder / "assembly.html").read_text())["plan"])


def rows_of(folder, name):
    return list(csv.DictReader(io.StringIO((folder / name).read_text())))


def piece_names(folder):
    rows = rows_of(folder, "pieces.csv")
    return {"pieces": {row["id"] for row in rows}, "threads": {row["thread"] for row in rows}}


def station_names(folder):
    rows = rows_of(folder, "stations.csv")
    return {
        "pieces": {row["piece"] for row in rows} | {row["partner"] for row in rows},
        "joints": {row["joint"] for row in rows} - {""},
    }


def crossing_names(folder):
    rows = rows_of(folder, "crossing_map.csv")
    return {
        "pieces": {row[f"{side}_piece"] for row in rows for side in ("over", "under")},
        "joints": {row["joint"] for row in rows} - {""},
    }


def manual_names(folder):
    pages = [page.extract_text() for page in pypdf.PdfReader(folder / "assembly.pdf").pages]
    text = "\n".join(pages[1:])  # the cover tells of materials and sizes
    return {
        "pieces": set(PIECE.findall(text)),
        "joints": set(JOINT.findall(text)),
        "threads": set(re.findall(r"\bThread ([A-Z]+)\b", text)),
        "sheets": set(re.findall(r"\bsheet_\d+\b", text)),
    }


def drawing_names(folder, kind):
    words = lettering(folder, kind)
    said = [word for own in words.values() for word in own]
    # What a piece says of others are names, too.
    assert set(PIECE.findall(" ".join(said).replace("→", " "))) <= set(words)
    return {
        # Each piece says its own name.
        "pieces": {key for key, own in words.items() if f"{key}→" in own},
        "joints": {key for word in said for key in JOINT.findall(word)},
        "sheets": {path.stem for path in (folder / "sheets").glob(f"*.{kind}")},
    }


READERS = {
    "assembly.html": viewer_names,
    "pieces.csv": piece_names,
    "stations.csv": station_names,
    "crossing_map.csv": crossing_names,
    "assembly.pdf": manual_names,
    "dxf": lambda folder: drawing_names(folder, "dxf"),
    "svg": lambda folder: drawing_names(folder, "svg"),
}


def same_names(folder, name):
    """Say whether a file has the names of the crossing map."""
    true = map_names(folder)
    return all(names == true[kind] for kind, names in READERS[name](folder).items())


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_all_files_have_the_same_names(folder, name):
    assert same_names(folder, name)


@pytest.mark.slow
def test_pieces_are_named_by_their_threads(folder):
    true = map_names(folder)
    assert {key.rstrip("0123456789") for key in true["pieces"]} == true["threads"]
    assert all(true.values())


def spoil(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("assembly.html", '"id":"B2"', '"id":"B22"'),
        ("pieces.csv", "\nB2,", "\nB22,"),
        ("pieces.csv", "\nB2,B,", "\nB2,BB,"),
        ("stations.csv", ",B2,", ",B22,"),
        ("crossing_map.csv", ",B2,", ",B22,"),
    ],
)
def test_another_name_in_one_file_is_noticed(folder, tmp_path, name, old, new):
    shutil.copytree(folder, tmp_path / "job")
    spoil(tmp_path / "job" / name, old, new)
    assert not same_names(tmp_path / "job", name)


@pytest.mark.parametrize("kind", ["dxf", "svg"])
def test_letters_of_another_piece_are_noticed(folder, tmp_path, kind):
    shutil.copytree(folder, tmp_path / "job")
    plan = json.loads((folder / "crossing_map.json").read_text())
    # The map exchanges the names of two pieces; the strokes say what they said.
    names = {piece["id"]: piece for piece in plan["pieces"]}
    one, other = names["A1"], names["B1"]
    one["id"], other["id"] = "B1", "A1"
    (tmp_path / "job" / "crossing_map.json").write_text(json.dumps(plan))
    assert not same_names(tmp_path / "job", kind)
