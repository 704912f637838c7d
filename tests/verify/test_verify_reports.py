"""Nothing that people read in the reports of a job can be another: each spoiling is found."""

import copy
from dataclasses import replace

import pytest
from jobs import OCTAHEDRON

from fabweave.verify.checks.model.bends import check_bends
from fabweave.verify.checks.model.unfolding import check_unfolding
from fabweave.verify.checks.reports.areas import check_areas
from fabweave.verify.checks.reports.estimate import check_estimate
from fabweave.verify.checks.reports.manual import check_manual
from fabweave.verify.checks.reports.materials import check_materials
from fabweave.verify.checks.reports.outcome import check_outcome
from fabweave.verify.checks.reports.page import check_page
from fabweave.verify.checks.reports.verdict import check_verdict
from fabweave.verify.checks.reports.viewer import check_viewer
from fabweave.verify.checks.sheets.offcuts import check_offcuts
from fabweave.verify.checks.sheets.qr_code import check_code
from fabweave.verify.checks.sheets.templates import check_templates
from fabweave.verify.read.job_files import load_job
from fabweave.verify.read.waste_page import Seen
from fabweave.verify.statement import Tally

CHECKS = {
    "areas": check_areas, "bends": check_bends, "code": check_code, "estimate": check_estimate,
    "manual": check_manual, "materials": check_materials, "offcuts": check_offcuts,
    "outcome": check_outcome, "page": check_page, "templates": check_templates,
    "unfolding": check_unfolding, "verdict": check_verdict, "viewer": check_viewer,
}  # fmt: skip


@pytest.fixture(scope="module")
def read(finished):
    """Return a finished job as read."""
    tally = Tally("files")
    job = load_job(finished(*OCTAHEDRON), tally)
    assert tally.result().ok
    return job


def findings(name, job):
    """Return what a check finds; what it cannot finish is a finding, too."""
    tally = Tally(name)
    try:
        CHECKS[name](job, tally)
    except (LookupError, TypeError, ValueError) as error:
        tally.unfinished(name, error)
    return tally.result().findings


@pytest.mark.parametrize("name", CHECKS)
def test_the_job_is_right(read, name):
    assert findings(name, read) == ()


def test_no_text_of_the_manual_can_be_another(read):
    for number, page in enumerate(read.manual):
        for at, text in enumerate(page.texts):
            for other in ("nothing", f"{text}0"):
                texts = (*page.texts[:at], other, *page.texts[at + 1 :])
                pages = list(read.manual)
                pages[number] = replace(page, texts=texts)
                assert findings("manual", replace(read, manual=tuple(pages))), (text, other)


@pytest.mark.parametrize("change", ["moved", "larger", "gone"])
def test_no_piece_of_the_parts_list_can_be_drawn_otherwise(read, change):
    number = next(n for n, page in enumerate(read.manual) if page.texts[0] == "Parts list")
    page = read.manual[number]
    assert len(page.figures[0]) > 4
    figures = list(page.figures)
    if change == "gone":
        del figures[0]
    else:
        figures[0] = figures[0] + 2.0 if change == "moved" else figures[0] * 1.02
    pages = list(read.manual)
    pages[number] = replace(page, figures=tuple(figures))
    found = findings("manual", replace(read, manual=tuple(pages)))
    # A piece may stand anywhere in the list.
    assert bool(found) != (change == "moved")


def test_nothing_on_the_page_on_material_can_be_another(read):
    page = read.waste_page
    for at, (tag, text) in enumerate(page):
        for other in ([Seen(tag, f"{text}0")], [], [page[at], Seen(tag, text)]):
            shown = (*page[:at], *other, *page[at + 1 :])
            assert findings("page", replace(read, waste_page=shown)), (tag, text, other)


@pytest.mark.parametrize(
    ("way", "value"),
    [
        (("hours", 1), lambda hours: hours + 0.1),
        (("hours",), []),
        (("seconds", 0), lambda seconds: seconds + 0.2),
        (("seconds",), lambda seconds: seconds[:-1]),
        (("seconds",), None),
    ],
)
def test_the_viewer_takes_the_hours_of_the_estimate(read, way, value):
    viewer = replace(read.viewer, hands=spoilt(read.viewer.hands, way, value))
    assert findings("viewer", replace(read, viewer=viewer))


def spoilt(document, way, value):
    """Return a copy of a document with another value somewhere."""
    document = copy.deepcopy(document)
    place = document
    for key in way[:-1]:
        place = place[key]
    place[way[-1]] = value(place[way[-1]]) if callable(value) else value
    return document


def more(value):
    return value * 1.1 + 1 if isinstance(value, float) else value + 1


RIBBONS = [
    (("threads", 0, "wave_deg"), lambda value: value * 1.02, "unfolding"),
    (("threads", 0, "wave_deg"), None, "unfolding"),
    (("limits", "bend_mm"), 8.8, "bends"),
    (("limits", "width_mm"), 1.5, "bends"),
    (("limits", "twist_deg"), 34.5, "bends"),
    (("smallest_size_mm",), more, "verdict"),
    (("smallest_size_mm",), None, "verdict"),
]


@pytest.mark.parametrize(("way", "value", "name"), RIBBONS)
def test_figures_of_the_ribbons(read, way, value, name):
    assert findings(name, replace(read, ribbons=spoilt(read.ribbons, way, value)))


WASTE = [
    (("material", "name"), "cardx", "materials"),
    (("material", "thickness_mm"), 0.9, "materials"),
    (("materials", 0, "bunches"), ["warp"], "materials"),
    (("kerf_mm",), 0.5, "materials"),
    (("estimate", "planned"), True, "estimate"),
    (("estimate", "materials", 0, "machine"), "diode", "estimate"),
    (("estimate", "materials", 0, "engrave_mm_s", 0), 55.0, "estimate"),
    (("estimate", "materials", 0, "rapid_mm_s", 0), 248.6, "estimate"),
    (("estimate", "materials", 0, "speed_source"), "x", "estimate"),
    (("estimate", "materials", 0, "price_source"), "x", "estimate"),
    (("estimate", "assembly", "actions", 0, "action"), "sortx", "estimate"),
    (("estimate", "assembly", "actions", 0, "words"), "to rest", "estimate"),
    (("estimate", "difficulty", "word"), "demanding", "estimate"),
    (("estimate", "difficulty", "width_mm"), lambda value: value + 0.1, "estimate"),
    (("estimate", "assumptions", 2), "Nothing is known.", "estimate"),
    (("estimate", "assumptions"), [], "estimate"),
    (("comparison", "rectangles", "sheets"), more, "areas"),
    (("comparison", "rectangles", "utilisation"), more, "areas"),
    (("comparison", "rectangles", "too_large"), more, "areas"),
    (("comparison", "strips", "area_mm2"), lambda value: value * 1.001, "areas"),
    (("comparison", "strips", "sheets"), more, "areas"),
    (("comparison", "strips", "utilisation"), more, "areas"),
    (("offcuts", 0, "rectangle", 0, 1), lambda value: value + 1.0, "offcuts"),
    (("splitting", "prefer"), "work", "areas"),
    (("splitting", "chosen", "longer"), 1, "areas"),
    (("splitting", "chosen", "exact"), False, "areas"),
    (("splitting", "chosen", "sheets"), more, "areas"),
]


@pytest.mark.parametrize(("way", "value", "name"), WASTE)
def test_figures_of_the_waste_report(read, way, value, name):
    assert findings(name, replace(read, waste=spoilt(read.waste, way, value)))


SETTINGS = [
    (("job", "paper"), "letter", "manual"),
    (("job", "paper"), "parchment", "manual"),
    (("job", "template"), "a4", "templates"),
    (("job", "template"), "parchment", "templates"),
    (("job", "bodies"), "largest", "code"),
    (("job", "smooth"), 4, "code"),
    (("job", "slots"), True, "code"),
    (("outcome", "hole_mm"), 3.3, "outcome"),
    (("outcome", "costs"), "costs: nothing", "outcome"),
]


@pytest.mark.parametrize(("way", "value", "name"), SETTINGS)
def test_settings_and_what_came_of_them(read, way, value, name):
    assert findings(name, replace(read, settings=spoilt(read.settings, way, value)))


PREDICTIONS = {
    "pieces": more, "joints": more, "longer": -1, "exact": False, "piece_mm2": more,
    "sheet_mm2": more, "utilisation": more, "hours": more, "cost": more, "max_length_mm": 60.0,
    # Few pieces were nested roughly: on no more sheets than there are pieces, whatever they cost.
    "sheets": lambda value: value + 20,
}  # fmt: skip


@pytest.mark.parametrize("key", [None, *PREDICTIONS])
def test_predictions_for_lengths_that_were_not_chosen(read, key):
    waste = copy.deepcopy(read.waste)
    splitting = waste["splitting"]
    longer = {**splitting["chosen"], "max_length_mm": splitting["max_length_mm"] + 10.0}
    splitting["choices"].append(longer)
    waste["notes"] = [note.replace("of 1 length", "of 2 lengths") for note in waste["notes"]]
    if key is not None:
        value = PREDICTIONS[key]
        longer[key] = value(longer[key]) if callable(value) else value
    assert bool(findings("areas", replace(read, waste=waste))) == (key is not None)


REMEDIES = [
    ({"size_mm": 400}, "its remedy"),
    ({"size_mm": 400, "remedy": "--size 400mm"}, "what its text says would mend it"),
    ({"width_factor": 0.9}, "its remedy"),
    ({"refine": "catmull-clark:1"}, "its remedy"),
    ({"text": "a wide hole"}, "nothing was found of which it is said"),
    ({"cause": "the moon"}, "does not say why"),
    ({"rule": "bend"}, "no note says the same"),
]


@pytest.mark.parametrize(("change", "words"), REMEDIES)
def test_what_is_said_to_mend_a_finding(read, change, words):
    finding = {"rule": "hole", "severity": "warn", "count": 1, "of": 12, "far": 0, "size_mm": 300,
               "width_factor": None, "refine": None, "cause": None, "remedy": "--size 300mm",
               "text": "a small hole. To fix it, use --size 300mm"}  # fmt: skip
    reason = {"rule": "hole", "level": "with care", "text": "a small hole",
              "advice": "leave those crossings without a fastener, or use glue"}  # fmt: skip
    job = replace(
        read,
        settings={**read.settings, "outcome": None},
        verdict={**read.verdict, "level": "with care", "reasons": [reason]},
        ribbons={**read.ribbons, "findings": [finding]},
    )
    assert findings("verdict", job) == ()
    finding.update(change)
    assert any(words in found for found in findings("verdict", job))
    if change.get("rule") is None:
        assert findings("verdict", replace(job, verdict={
            **job.verdict, "reasons": [{**reason, "advice": "hope"}]}))  # fmt: skip
