"""Small crossing maps for tests that need a part of one: the rest is what no test looks at."""

from fabweave.plan.crossing_map import (
    AssemblyRecord,
    CrossingMap,
    CutoutRecord,
    CutRecord,
    LayoutRecord,
    PieceRecord,
    PlacementRecord,
    RotationRecord,
    SheetRecord,
    StationRecord,
    StepRecord,
    WeaveRecord,
)
from fabweave.weave.twill.conditions import Broken


def small_map(**parts):
    """Return a map with some parts; all others are empty."""
    lists = ("sheets", "threads", "crossings", "pieces", "joints", "steps")
    return CrossingMap(
        **{
            "schema": "fabweave.crossing-map/1",
            "units": "mm",
            "weave": WeaveRecord(pattern="plain", exact=True, broken=Broken(0, 0, 0)),
            "layout": LayoutRecord(
                margin_mm=5.0,
                gap_mm=2.0,
                rotations=RotationRecord(step_deg=None, tolerance_deg=0.0),
                notes=(),
            ),
            "cut": CutRecord(
                profile="full",
                preset="lightburn",
                dxf="R2010",
                svg_units="mm",
                hairline_mm=0.025,
                layers=(),
            ),
            "assembly": AssemblyRecord(effort=1.0, by_thread=1.0, by_number=1.0, last_tenth=1.0),
            **dict.fromkeys(lists, ()),
            **{name: tuple(part) if name in lists else part for name, part in parts.items()},
        }
    )


def points(values):
    """Return rows of numbers as a record has them."""
    return tuple(tuple(float(value) for value in row) for row in values)


def sheet_record(number=1, width_mm=600.0, height_mm=400.0, **parts):
    """Return a sheet; a rectangle without defects, if nothing else is said."""
    edge = ((0, 0), (width_mm, 0), (width_mm, height_mm), (0, height_mm))
    return SheetRecord(
        **{
            "sheet": number,
            "name": f"sheet_{number:02d}",
            "width_mm": width_mm,
            "height_mm": height_mm,
            "mirrored": False,
            "stock": "",
            "offcut": False,
            "price": None,
            "grain_deg": None,
            "outline": points(edge),
            "defects": (),
            "material": "card",
            "thickness_mm": 0.4,
            **parts,
        }
    )


def station_record(crossing, *, over=True, partner="Z1", x=0.0, y=0.0, hole_mm=None, joint=None):
    """Return a station."""
    return StationRecord(
        crossing=crossing, over=over, partner=partner, x=x, y=y, hole_mm=hole_mm, joint=joint
    )


def piece_record(name, outline, holes=(), *, sheet=1, turn=0.0, at=(0.0, 0.0), **parts):
    """Return a piece of the first thread with round holes (x, y, diameter), on its sheet."""
    return PieceRecord(
        **{
            "id": name,
            "kind": 1,
            "thread": 0,
            "sheet": sheet,
            "placement": PlacementRecord(rotation_deg=turn, x_mm=at[0], y_mm=at[1]),
            "joints": (None, None),
            "path": points((*point, 0.0) for point in outline),
            "outline": points(outline),
            "stations": (),
            "cutouts": tuple(
                CutoutRecord(station=0, kind="hole", x=float(x), y=float(y), diameter_mm=diameter)
                for x, y, diameter in holes
            ),
            "labels": (),
            "dropped": (),
            **parts,
        }
    )


def step_record(number, **parts):
    """Return a step that does nothing but what is said."""
    lists = ("pieces", "crossings", "over", "under", "joints", "fasten")
    return StepRecord(
        step=number,
        **{
            **dict.fromkeys(lists, ()),
            "closes": False,
            "effort": 1.0,
            "text": "Lay it down.",
            **parts,
        },
    )
