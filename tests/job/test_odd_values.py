"""Whatever a Python user gives, fabweave takes it or raises an error of its own, in words."""

import inspect
from collections.abc import Callable
from datetime import date
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import fabweave as fw
from fabweave.options.settings import settings_from_options
from fabweave.options.table import OPTIONS

pytestmark = pytest.mark.usefixtures("quick_jobs")


class Unwritten:
    """Something that cannot be written."""

    def __repr__(self):
        raise RuntimeError


def nested(depth):
    """Return a list in a list in a list, and so on."""
    lists = []
    for _ in range(depth):
        lists = [lists]
    return lists


ODD = (
    None, True, 0, -1, 2.5, float("nan"), float("inf"), -1e300, 1e-300, 10**5000, 2**63, 1j,
    Fraction(1, 2), Decimal("NaN"), date(2020, 1, 1), "", "odd", "nan", "1e400", "a\0b", "\udcff",
    b"odd", [], (1, 2, 3), (float("nan"), 1), ("a", "b"), [object()], nested(5000), {}, {1: 2},
    {"a": object()}, {1}, range(3), object(), int, lambda: 0, ..., (odd for odd in "odd"),
    Unwritten(), Path("odd"), np.float64(3), np.int64(1), np.float32("nan"), np.array([]),
    np.zeros((3, 2)), np.array(["a"]), np.array([object()]), np.array(1.0), np.datetime64("2020"),
)  # fmt: skip
CORNERS = [[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
#: A batch of nothing.
NO_JOB: dict[str, dict[str, str]] = {}
#: A picture of few pixels.
SMALL = {"size_px": (30, 20), "samples": 1}


def looks(name: str) -> dict[str, Callable]:
    """Return how a value that shows itself is given each argument of its picture."""
    return {
        f"{name}.picture size_px": lambda at, odd: getattr(at, name).picture(size_px=odd),
        f"{name}.picture size_px, width": lambda at, odd: getattr(at, name).picture(
            size_px=(odd, 20), samples=1
        ),
        f"{name}.picture view": lambda at, odd: getattr(at, name).picture(view=odd, **SMALL),
        f"{name}.picture view, elevation": lambda at, odd: getattr(at, name).picture(
            view=(0, odd), **SMALL
        ),
        f"{name}.picture across": lambda at, odd: getattr(at, name).picture(across=odd, **SMALL),
        f"{name}.picture samples": lambda at, odd: getattr(at, name).picture(
            **SMALL | {"samples": odd}
        ),
    }


#: Every argument of every public function and method. No job is made: what is good besides an odd
#: value comes with something that is refused later.
CALLS: dict[str, Callable] = {
    **looks("Mesh"), **looks("Ribbons"), **looks("Yarns"),
    "Ribbons.relax pins": lambda at, odd: at.Ribbons.relax(pins=odd),
    "Ribbons.relax pins, each": lambda at, odd: at.Ribbons.relax(pins=[odd] * 32),
    "Weave.yarns radius": lambda at, odd: at.Weave.yarns(radius=odd),
    "Weave.yarns sides": lambda at, odd: at.Weave.yarns(sides=odd),
    "Layout.picture sheet": lambda at, odd: at.Layout.picture(odd),
    "Layout.write folder": lambda at, odd: isinstance(odd, str | Path) or at.Layout.write(odd),
    "Settings.of source": lambda _, odd: fw.Settings.of(odd),
    "Settings.narrower factor": lambda _, odd: fw.Settings.of("shape:cube").narrower(odd),
    "batch jobs": lambda _, odd: fw.batch(odd, "here"),
    "batch folder": lambda _, odd: fw.batch(NO_JOB, odd),
    "batch together": lambda _, odd: fw.batch(NO_JOB, "shape:odd", together=odd),
    "batch told": lambda _, odd: fw.batch(NO_JOB, "here", told=odd),
    "batch progress": lambda _, odd: fw.batch(NO_JOB, "here", progress=odd),
    "batch workers": lambda _, odd: fw.batch(NO_JOB, "here", workers=odd),
    "batch executors": lambda _, odd: fw.batch(NO_JOB, "here", executors=odd),
    "design mesh": lambda _, odd: fw.design(odd),
    "design tries": lambda _, odd: fw.design("shape:odd", tries=odd),
    "design pieces": lambda _, odd: fw.design("shape:odd", pieces=odd),
    "design goal": lambda _, odd: fw.design("shape:odd", goal=odd),
    "design progress": lambda _, odd: fw.design("shape:odd", progress=odd),
    "design workers": lambda _, odd: fw.design("shape:odd", workers=odd),
    "design executors": lambda _, odd: fw.design("shape:odd", executors=odd),
    "Design.write folder": lambda at, odd: isinstance(odd, str | Path) or at.Design.write(odd),
    "Design.write progress": lambda at, odd: at.Design.write("here", progress=odd, size="odd"),
    "Design.write workers": lambda at, odd: at.Design.write("here", workers=odd, size="odd"),
    "Design.write executors": lambda at, odd: at.Design.write("here", executors=odd, size="odd"),
    "inspect workers": lambda _, odd: fw.inspect("shape:odd", workers=odd),
    "inspect executors": lambda _, odd: fw.inspect("shape:odd", executors=odd),
    "inspect mesh": lambda _, odd: fw.inspect(odd),
    "inspect progress": lambda _, odd: fw.inspect("shape:odd", progress=odd),
    "inspect thorough": lambda _, odd: fw.inspect("shape:odd", thorough=odd),
    "inspect designs": lambda _, odd: fw.inspect("shape:odd", designs=odd),
    "make pieces": lambda _, odd: fw.make("shape:odd", "here", pieces=odd),
    "make goal": lambda _, odd: fw.make("shape:odd", "here", goal=odd),
    "make mesh": lambda _, odd: fw.make(odd, "here"),
    "make folder": lambda _, odd: fw.make("shape:odd", odd),
    "make progress": lambda _, odd: fw.make("shape:odd", "here", progress=odd),
    "make executors": lambda _, odd: fw.make("shape:odd", "here", executors=odd),
    "make workers": lambda _, odd: fw.make("shape:odd", "here", workers=odd),
    "mesh vertices": lambda _, odd: fw.mesh(odd),
    "mesh vertices, with faces": lambda _, odd: fw.mesh(odd, FACES),
    "mesh vertices, one": lambda _, odd: fw.mesh([[odd, 1, 1], *CORNERS[1:]], FACES),
    "mesh faces": lambda _, odd: fw.mesh(CORNERS, odd),
    "mesh faces, one": lambda _, odd: fw.mesh(CORNERS, [odd, *FACES[1:]]),
    "mesh faces, corner": lambda _, odd: fw.mesh(CORNERS, [[odd, 2, 1], *FACES[1:]]),
    "mesh name": lambda _, odd: fw.mesh(CORNERS, FACES, name=odd),
    "read path": lambda _, odd: fw.read(odd),
    "shape name": lambda _, odd: fw.shape(odd),
    "shape size": lambda _, odd: fw.shape("tetrahedron", size=odd),
    "shape parameters": lambda _, odd: fw.shape("torus", m=odd),
    "verify folder": lambda _, odd: fw.verify(odd),
    "weave mesh": lambda _, odd: fw.weave(odd),
}  # fmt: skip


@pytest.fixture(scope="module")
def steps():
    """Every step of a small job."""
    weave = fw.weave("shape:torus?m=4&n=4", size=200)
    ribbons = weave.ribbons()
    layout = ribbons.pieces().nest(effort="quick")
    mesh, yarns = fw.shape("tetrahedron", size=100), weave.yarns()
    (designed, *_) = fw.design("shape:tetrahedron", tries=1, size=200, effort="quick")
    return SimpleNamespace(
        Mesh=mesh, Weave=weave, Ribbons=ribbons, Yarns=yarns, Layout=layout, Design=designed
    )


def refusals(call: Callable[[object], object]) -> list[str]:
    """Give a call every odd value; return in which words it refused what it did not take."""
    told = []
    for odd in ODD:
        try:
            call(odd)
        except fw.FabweaveError as error:
            told.append(str(error))
    return told


def in_words(told: list[str]) -> bool:
    """Return whether refusals say something, and nothing that differs from run to run."""
    return all(told) and not any(" at 0x" in words for words in told)


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", CALLS)
def test_odd_values_are_taken_or_refused_in_words(name, steps, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = refusals(lambda odd: CALLS[name](steps, odd))
    assert in_words(told)
    assert len(told) > len(ODD) / 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option", OPTIONS, ids=lambda option: option.name)
def test_odd_values_of_options_are_taken_or_refused_in_words(option, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = refusals(lambda odd: settings_from_options(**{"mesh": "shape:cube", option.name: odd}))
    told += refusals(lambda odd: fw.Settings.of(**{"source": "shape:cube", option.field: odd}))
    assert in_words(told)
    assert len(told) > len(ODD) / 2


def test_every_argument_of_everything_public_is_tried():
    wanted = set()
    for name in fw.__all__:
        public = getattr(fw, name)
        calls = {name: public}
        if isinstance(public, type):
            calls = {f"{name}.{method}": getattr(public, method) for method in dir(public)}
        for call, function in calls.items():
            if "._" not in call and getattr(function, "__module__", "").startswith("fabweave"):
                for one in inspect.signature(function).parameters.values():
                    # Options have a test of their own; how a weave looks is how its ribbons do.
                    if one.name != "self" and one.kind is not one.VAR_KEYWORD:
                        wanted.add(f"{call} {one.name}")
    assert len(wanted) > 25
    assert wanted <= set(CALLS)


@pytest.mark.parametrize("wide", [1, 2, 5, 9, 13])
def test_pictures_of_few_pixels_have_their_size(wide, steps):
    assert steps.Ribbons.picture(size_px=(wide, 20), samples=1).size == (wide, 20)
