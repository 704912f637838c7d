"""Tips where ribbons are slivers are found, and opened by what is offered."""

import re

import numpy as np
import pytest
from jobs import laid
from meshes_shared import real_mesh

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.ribbon.lay import WovenObject, opening_notes, require_wide
from fabweave.ribbon.measures import ribbon_widths
from fabweave.ribbon.width import PROPORTIONAL


def globe(meridians: int, parallels: int, axis: int = 2) -> PolyMesh:
    """Return a sphere of radius 1 with a pole of so many triangles at either end of an axis."""
    fall, turn = np.meshgrid(
        np.linspace(0.0, np.pi, parallels + 1)[1:-1],
        np.arange(meridians) * 2.0 * np.pi / meridians,
        indexing="ij",
    )
    ring = [np.sin(fall) * np.cos(turn), np.sin(fall) * np.sin(turn), np.cos(fall)]
    points = np.stack(ring, axis=-1).reshape(-1, 3)
    points = np.roll(np.concatenate([[[0, 0, 1], [0, 0, -1]], points]), axis - 2, axis=1)
    number = 2 + np.arange(len(points) - 2).reshape(-1, meridians)
    after = np.roll(number, -1, axis=1)
    quads = np.stack([number[:-1], number[1:], after[1:], after[:-1]], axis=-1).reshape(-1, 4)
    faces = [[0, *pair] for pair in zip(number[0].tolist(), after[0].tolist(), strict=True)]
    faces += quads.tolist()
    faces += [[1, *pair] for pair in zip(after[-1].tolist(), number[-1].tolist(), strict=True)]
    return PolyMesh.from_faces(points, faces)


def woven(mesh: PolyMesh, **options) -> WovenObject:
    return laid("globe.obj", mesh, course="straight", **options)[0]


@pytest.mark.parametrize(
    ("meridians", "size", "axis"), [(24, 200.0, 2), (12, 100.0, 2), (12, 100.0, 0)]
)
def test_what_is_offered_at_a_pole_makes_room_there(meridians, size, axis) -> None:
    ball = globe(meridians, meridians // 2, axis)
    made = woven(ball, size_mm=size, width=PROPORTIONAL)
    (note,) = opening_notes(made)
    narrow = float(ribbon_widths(made.ribbons).min())
    assert "(vertex 0, 1)" in note
    (option,) = re.findall(r"; --leave-out (\S+) opens the mesh there", note)
    if axis == 2:
        # The rim stays on the first parallel, to a millimetre.
        diameter = size * np.sin(np.pi / (meridians // 2))
        told = [float(one) for one in re.findall(r"(?:top|bottom):(\d+)mm", option)]
        assert told == pytest.approx([diameter] * 2, abs=1.0)
    else:
        # The faces at both poles, by number.
        poles = [n for n, face in enumerate(ball.faces()) if {0, 1} & set(face)]
        assert option == ",".join(map(str, poles))
    opened = woven(ball, size_mm=size, leave_out=option, width=PROPORTIONAL)
    assert opened.mesh.n_faces == ball.n_faces - 2 * meridians
    assert opening_notes(opened) == []
    assert ribbon_widths(opened.ribbons).min() > 2.5 * narrow


def test_where_ribbons_have_room_nothing_is_said() -> None:
    made = woven(globe(12, 6), size_mm=800.0)
    assert opening_notes(made) == []
    for shape in ("shape:sphere?n=4", "shape:bipyramid?n=2&edge=4&handle=4"):
        made = laid(shape, size_mm=300.0)[0]
        assert opening_notes(made) == []


def test_tips_of_rings_are_named_and_saddles_are_not() -> None:
    model = real_mesh("rings/spot_rings.obj", 200.0)
    made = woven(model, size_mm=200.0)
    (note,) = opening_notes(made)
    tips = [int(one) for one in re.search(r"\(vertex ([\d, ]+)", note)[1].split(", ") if one]
    own = [[len(face) for face in model.faces() if tip in face] for tip in tips]
    assert tips
    assert all(set(sizes) == {3} for sizes in own)


def test_a_refusal_offers_the_opening_and_no_number_that_another_mesh_has() -> None:
    made = woven(globe(48, 24), size_mm=20.0)
    with pytest.raises(CannotMakeError, match=r"would burn away; .*\. tips: .*--leave-out top:"):
        require_wide(made)
    made = woven(globe(24, 12), size_mm=200.0, leave_out="100")
    assert "opens the mesh" not in opening_notes(made)[0]
