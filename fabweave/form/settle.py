"""Say whether a woven object keeps its form when the maker lets go."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen
from fabweave.core.messages import agree
from fabweave.core.records import record
from fabweave.form.relax import relax, soft_modes
from fabweave.form.woven_net import Elastic, woven_net
from fabweave.mesh.likeness import name_place
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.symmetry import best_motions
from fabweave.ribbon.project import Ribbons
from fabweave.stock.material import Material
from fabweave.stock.supplies import Supplies
from fabweave.weave.pattern import Weave

#: How a crossing resists turning, N mm per radian: strips that only lie on one another, one
#: fastener, and two or more of them. Estimates: friction scatters by as much as these differ.
BARE, PINNED, RIVETED = 1.0, 25.0, 10_000.0
#: Poisson's ratio of what it is not known of.
POISSON = 0.3
#: Objects of more crossings are not let go: it would take minutes.
MOST_CROSSINGS = 20_000
#: What settles by no more than this share of its size keeps its form.
BOUND = 0.01
#: An object stands on what is no higher than this share of its size, three crossings at least; a
#: foot yields by so many millimetres to a newton.
_FOOT, _YIELDS = 0.02, 1e-3
#: When steps gain no more than this share of the energy, what is left is less than a maker sees.
_GAIN = 2e-5
#: A mode is loose if its own weight is enough to move an object by such a share of its size.
_LOOSE, _MODES = 0.01, 12


@record
class Form:
    """What becomes of an object's form when the maker lets go.

    Parameters
    ----------
    settles_mm, mean_mm : float
        How far its crossings go from where they were wished, at most, and in the root mean square.
    where : str
        Where they go farthest.
    bound_mm : float
        What keeps its form settles by no more than that.
    sags_mm : float
        How far it sags under its own weight, standing on its lowest crossings.
    loose : int
        In how many ways it moves about under its own weight.
    settled : bool
        Whether it came to rest; else it goes on from there.
    """

    settles_mm: float
    mean_mm: float
    where: str
    bound_mm: float
    sags_mm: float
    loose: int
    settled: bool

    @property
    def keeps(self) -> bool:
        """Whether it keeps its form."""
        return self.settles_mm <= self.bound_mm and self.settled

    @property
    def text(self) -> str:
        """What a maker wants to read of it."""
        if self.keeps:
            said = f"keeps its form within {_length(self.settles_mm)}"
        else:
            said = f"settles by {_length(self.settles_mm)}, most at the {self.where}"
        if not self.settled:
            said += " and does not come to rest"
        parts = [said, f"sags {_length(self.sags_mm)} under its own weight"]
        if self.loose:
            parts.append(agree(self.loose, "moves about in {n} way[|s] under that"))
        return "; ".join(parts)


def _length(length_mm: float) -> str:
    """Return a length as makers say it."""
    return f"{length_mm:.0f} mm" if length_mm >= 10.0 else f"{max(length_mm, 0.1):.1f} mm"


def elastic(material: Material, *, grain: bool) -> Elastic | None:
    """Return what a material resists with; None if that is not known of it.

    Parameters
    ----------
    material : Material
    grain : bool
        Whether strips lie along its grain, or across where it is laid so; else every way.
    """
    if material.young_mpa is None:
        return None
    along, across = material.young_mpa
    own = across if material.laid_across else along
    young = own if grain else float(np.sqrt(along * across))
    poisson = POISSON if material.poisson is None else material.poisson
    return Elastic(young, poisson, material.density_kg_m3)


def elastic_threads(supplies: Supplies, bunches: IntArray, *, grain: bool) -> list[Elastic | None]:
    """Return what each thread resists with, as :func:`elastic` says it of its material."""
    each = [elastic(supply.material, grain=grain) for supply in supplies.each]
    return [each[at] for at in supplies.of(bunches).tolist()]


def pin_stiffness(fastened: BoolArray, riveted: Sequence[int]) -> FloatArray:
    """Return how crossings resist turning, (X,): ``riveted`` are those of two fasteners or more."""
    pins = np.where(fastened, PINNED, BARE)
    pins[list(riveted)] = RIVETED
    return pins


class Settled(NamedTuple):
    """An object that was let go: what became of its form, and of its crossings.

    ``wished`` and ``rested`` are (X, 3), millimetres: where its crossings are wished to be, and
    where they come to rest, after the rigid motion that brings them nearest to that.
    """

    form: Form
    wished: FloatArray
    rested: FloatArray


def settle(
    mesh: PolyMesh,
    ribbons: Ribbons,
    weave: Weave,
    thickness_mm: FloatArray,
    materials: Sequence[Elastic | None],
    pins: FloatArray,
) -> Settled | None:
    """Let a woven object go, and say what becomes of its form.

    Its strips are as they are cut. What is not known: friction's scatter, contact beside the
    crossings, creep and humidity.

    Parameters
    ----------
    mesh : PolyMesh
        That is woven; z points up.
    ribbons, weave
    thickness_mm : (T,) float array
        Of each thread.
    materials : sequence of Elastic or None
        Of each thread.
    pins : (X,) float array
        How crossings resist turning, N mm per radian.

    Returns
    -------
    Settled or None
        None where a material is not known well enough, and where it would take minutes.
    """
    known = [one for one in materials if one is not None]
    if len(known) < len(materials) or not 3 <= len(pins) <= MOST_CROSSINGS:
        return None
    with threadpool_limits(limits=1, user_api="blas"):
        net, wished = woven_net(ribbons, weave, thickness_mm, known, pins)
        free = replace(net, weight=0 * net.weight)
        rest = relax(free, wished, gain=_GAIN)
        places, origin = rest.state.bodies.origin, wished.bodies.origin
        rested = fitted(places, origin)
        away = np.linalg.norm(rested - origin, axis=1)
        size = float(np.ptp(mesh.vertices, axis=0).max())

        height = places[:, 2] - places[:, 2].min()
        low = np.argsort(height, kind="stable")
        feet = low[: max(3, int(np.count_nonzero(height <= _FOOT * size)))]
        held = np.zeros_like(net.held)
        held[feet] = 1.0 / _YIELDS
        stood = relax(replace(net, held=held, place=places), rest.state, gain=_GAIN)
        sag = np.linalg.norm(stood.state.bodies.origin - places, axis=1)

        count = min(_MODES, 6 * net.n_bodies - 1)
        stiffness, _ = soft_modes(free, rest.state, count)
    weight = float(-net.weight[:, 2].sum())
    # All bodies move by a share of the size: half of the stiffness times their squares, or less.
    enough = 2.0 * weight / (net.n_bodies * _LOOSE * size)
    farthest = int(away.argmax())
    form = Form(
        settles_mm=round(float(away[farthest]), 2),
        mean_mm=round(float(np.sqrt((away**2).mean())), 2),
        where=name_place(origin[farthest], mesh),
        bound_mm=round(BOUND * size, 2),
        sags_mm=round(float(sag.max()), 2),
        loose=max(int(np.count_nonzero(stiffness < enough)) - 6, 0),
        settled=rest.settled and stood.settled,
    )
    return Settled(form, frozen(origin), frozen(rested))


def fitted(places: FloatArray, to: FloatArray) -> FloatArray:
    """Return places after the rigid motion that brings them nearest to others, (N, 3)."""
    own, aim = places - places.mean(axis=0), to - to.mean(axis=0)
    return np.asarray(own @ best_motions(own, aim, mirrors=False).T + to.mean(axis=0))
