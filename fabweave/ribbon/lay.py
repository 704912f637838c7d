"""Lay the ribbons of a weave, with the widths that fit: the woven object, before it is cut."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    flags,
    frozen_value,
    no_progress,
)
from fabweave.core.errors import TooFineError
from fabweave.core.finding import Note
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.ribbon.aim import Aim
from fabweave.ribbon.even import even_rails, even_widths, short_panels
from fabweave.ribbon.measures import open_share, require_width, ribbon_widths, tip_notes
from fabweave.ribbon.project import (
    Ribbons,
    crossing_heights,
    following_rung,
    project_ribbons,
    smooth_ribbons,
)
from fabweave.ribbon.rules.bends import Bends, measure_bends
from fabweave.ribbon.rules.clearance import Nearness
from fabweave.ribbon.rules.remedy import Depth, is_too_stiff
from fabweave.ribbon.rules.ribbon_check import RibbonCheck, check_ribbons, require_pliable
from fabweave.ribbon.rules.rules import Measured, measure_along, measure_clearance, pass_of_rungs
from fabweave.ribbon.settings import RibbonSettings
from fabweave.ribbon.stretches import ends_of_stretches
from fabweave.ribbon.width import WidthRule, tapered
from fabweave.stock.material import forming_advice
from fabweave.stock.ribbon_limits import Limits, by_thread, thinner_supply, thread_limits
from fabweave.stock.supplies import Supplies
from fabweave.weave.pattern import Weave
from fabweave.weave.weave_mesh import WovenMesh

#: Lays ribbons with a factor on the width at each pass, (P,).
LayNarrowed: TypeAlias = Callable[[FloatArray], Ribbons]

#: So much narrower is the next width tried where ribbons are too near.
_STEP = 0.9
#: Ribbons stay this many times as wide as the least to handle: facets between panels are slanted.
_HANDLED = 1.05


@frozen_value
class Narrowing:
    """Ribbons that are narrower where they would be too near to others.

    Parameters
    ----------
    ribbons : Ribbons
    factor : (P,) float array
        Factor on the width at each pass, in (0, 1].
    least : (P,) float array
        The factors that would leave ribbons just wide enough to be handled; more than 1 where
        they are too narrow as they are.
    clearance : (Measured, Nearness) or None
        What is too near though it may be no narrower; None where that was not measured, as the
        material is far too stiff.
    """

    ribbons: Ribbons
    factor: FloatArray
    least: FloatArray
    clearance: tuple[Measured, Nearness] | None

    @property
    def stuck(self) -> IntArray:
        """The passes beside which ribbons are too near, and may be no narrower."""
        if self.clearance is None:
            return np.zeros(0, dtype=np.int64)
        return np.unique(
            ends_of_stretches(
                self.ribbons.pass_offsets, self.ribbons.closed, self.clearance[1].pairs
            )
        )


def narrow_ribbons(
    lay: LayNarrowed, weave: Weave, limits: Limits, most: FloatArray | None = None
) -> Narrowing:
    """Narrow ribbons, step by step, about the places where they are too near to one another.

    Where two stretches are too near, the ribbon gets narrower at the crossings at their ends, and
    tapers to them from its neighbours. None gets narrower than the least to handle. What a
    material is far too stiff for is left as wide as it is.

    Parameters
    ----------
    lay : callable
        Lays ribbons with a factor on the width at each pass.
    weave : Weave
    limits : Limits
    most : (P,) float array, optional
        Factors that are not exceeded, whatever is left to be handled.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import tetrahedron
    >>> from fabweave.ribbon.project import project_ribbons
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = tetrahedron()
    >>> halfedges = build_halfedges(mesh)
    >>> weave = plain_weave(trace_threads(halfedges))
    >>> def lay(factor):
    ...     return project_ribbons(mesh, halfedges, weave, height_mm=0.005, narrowing=factor)
    >>> limits = Limits(thickness_mm=0.01, bend_mm=0.1, width_mm=0.01, twist_deg=30.0)
    >>> narrowing = narrow_ribbons(lay, weave, limits)
    >>> sorted(set(narrowing.factor.round(2).tolist())), len(narrowing.stuck)
    ([0.9], 0)
    """
    factor = top = np.ones(len(weave.threads.crossing))
    ribbons = lay(factor)
    bends = measure_bends(ribbons)
    least = _least_factors(ribbons, limits, bends)
    if most is not None:
        following = following_rung(weave.threads.offsets, weave.threads.closed)
        factor = top = tapered(most, following)
        ribbons = lay(factor)
        bends = measure_bends(ribbons)
    if is_too_stiff(measure_along(ribbons, limits, bends)["bend"]):
        return Narrowing(ribbons, factor, least, None)
    floor = np.minimum(least, top)
    clearance, near = measure_clearance(ribbons, weave, limits)
    while True:
        narrower = _cleared(lay, weave, limits, near.pairs, factor, floor)
        if narrower is factor:
            # In tight bends ribbons may have got narrower than their crossing panels: too narrow.
            thin = _least_factors(ribbons, limits, measure_bends(ribbons)) > _HANDLED
            weak = np.flatnonzero(thin & (factor < top) & (floor < top))
            if not len(weak):
                return Narrowing(ribbons, factor, least, (clearance, near))
            floor[weak] = np.minimum(factor[weak] / _STEP, top[weak])
            narrower = np.maximum(factor, floor)
        factor, ribbons = narrower, lay(narrower)
        clearance, near = measure_clearance(ribbons, weave, limits)


def _cleared(
    lay: LayNarrowed,
    weave: Weave,
    limits: Limits,
    pairs: IntArray,
    factor: FloatArray,
    floor: FloatArray,
) -> FloatArray:
    """Return factors at which pairs of stretches are apart, or may be no narrower.

    The same array if none may be narrower now.
    """
    rows = weave.threads.offsets, weave.threads.closed
    following = following_rung(*rows)
    while True:
        passes = ends_of_stretches(*rows, pairs)
        free = (factor[passes] > floor[passes]).any(axis=(1, 2))
        if not free.any():
            return factor
        pairs, passes = pairs[free], passes[free]
        narrower = factor.copy()
        narrower[np.unique(passes)] *= _STEP
        factor = np.maximum(tapered(narrower, following), floor)
        pairs = measure_clearance(lay(factor), weave, limits, pairs)[1].pairs


def _least_factors(ribbons: Ribbons, limits: Limits, bends: Bends) -> FloatArray:
    """Return the factors, (P,), that leave ribbons as wide as can be handled.

    What lies between two panels depends on both, so either has what leaves all of it wide enough.
    """
    width = bends.width_mm
    measured = ~np.isnan(width)
    passes = pass_of_rungs(ribbons)[measured]
    thread = np.repeat(np.arange(len(ribbons.closed)), np.diff(ribbons.pass_offsets))
    following = following_rung(ribbons.pass_offsets, ribbons.closed)[passes]
    least = np.full(len(ribbons.entry), np.inf)
    np.minimum.at(least, passes, width[measured])
    np.minimum.at(least, following[following >= 0], width[measured][following >= 0])
    return _HANDLED * by_thread(limits.width_mm, thread) / np.maximum(least, 1e-9)


#: The widest width is found to this share of itself.
_CLOSE = 0.02


def widest_width(
    mesh: PolyMesh,
    halfedges: Halfedges,
    weave: Weave,
    *,
    length: float,
    portals: FloatArray | None = None,
) -> float:
    """Return the greatest width, in millimetres, that ribbons have room for everywhere.

    No ribbon may be wider than the crossing panel of its partner is long, relative to the room
    that each has, or its connectors run into the partner's panel.

    Parameters
    ----------
    mesh, halfedges, weave
        A mesh and the weave on it.
    length : float
        Relative length of crossing panels.
    portals : (H,) float array, optional
        As in :func:`~fabweave.ribbon.project.project_ribbons`.
    """
    widest = project_ribbons(
        mesh, halfedges, weave, height_mm=0.0, length=length, width=length, portals=portals
    )
    return float(ribbon_widths(widest).min(initial=np.inf))


def widest_clear(
    lay: Callable[[float], Ribbons], weave: Weave, limits: Limits, room_mm: float
) -> float | None:
    """Return the greatest width of all ribbons at which they keep clear of one another.

    Parameters
    ----------
    lay : callable
        Lays ribbons of one width, in millimetres.
    weave : Weave
    limits : Limits
    room_mm : float
        No greater width is tried, as from :func:`widest_width`.

    Returns
    -------
    float or None
        At this width all have been measured; at one that is 2 % greater some are too near, or
        have no room. None if some are too near even at the least width to handle.
    """
    least = float(np.max(limits.width_mm, initial=0.0))
    if not least <= room_mm < np.inf:
        return None

    def near(width_mm: float, among: IntArray | None = None) -> IntArray:
        return measure_clearance(lay(width_mm), weave, limits, among)[1].pairs

    high, too_near = room_mm, near(room_mm)
    among = too_near
    while len(too_near):
        # The pairs that are too near decide on a width; then all are measured there.
        low = least
        if len(near(low, among)):
            return None
        while high > low * (1 + _CLOSE):
            middle = float(np.sqrt(low * high))
            low, high = (low, middle) if len(near(middle, among)) else (middle, high)
        high, too_near = low, near(low)
        among = np.concatenate((among, too_near))
    return high


#: Ribbons of this share of a width are as wide, to the eye.
_AS_WIDE = 0.98


@frozen_value
class WovenObject(WovenMesh):
    """A woven mesh with its ribbons, before anything is unfolded or cut.

    Parameters
    ----------
    ribbons : Ribbons
        The ribbons.
    laps : (N,) int array or None
        The crossings at which there is room for a lap; None for all.
    narrowed : Narrowing or None
        Where ribbons are narrower than asked; None if they are as wide as asked.
    apart : (P,) float array or None
        The factors on the width that keep ribbons clear of one another, where some must be narrower
        yet so as not to cross themselves; None where none must.
    straight : bool
        Whether its strips are straight: then its ribbons were not laid on the mesh, but drawn to it
        (:mod:`fabweave.form.straight`), and are not laid anew.
    aim : Aim or None
        What it is to settle onto, where its mesh was moved for that; else its mesh.
    """

    ribbons: Ribbons
    laps: IntArray | None = None
    narrowed: Narrowing | None = None
    apart: FloatArray | None = None
    straight: bool = False
    aim: Aim | None = None

    @property
    def wished(self) -> PolyMesh:
        """The mesh as it is to be in the end."""
        return self.mesh if self.aim is None else self.aim.mesh


def lay_object(
    woven: WovenMesh, settings: RibbonSettings, supplies: Supplies, progress: Progress = no_progress
) -> WovenObject:
    """Lay the ribbons of a woven mesh as wide as asked.

    There is room for a lap at every crossing: before pieces are planned, a joint may come to lie
    at any.
    """
    progress("ribbons", 0, 1)
    thickness = supplies.thickness_mm(woven.bunches)
    ribbons = lay_ribbons(woven.source, woven.weave, settings, thickness)
    return WovenObject(woven.source, woven.result, woven.labels, woven.bunches, ribbons)


def lay_ribbons(
    source: LoadedMesh,
    weave: Weave,
    settings: RibbonSettings,
    thickness_mm: FloatArray,
    laps: IntArray | None = None,
    narrowing: FloatArray | None = None,
) -> Ribbons:
    """Lay the ribbons of a weave, with room for two layers, and for three where a joint laps.

    Parameters
    ----------
    woven, weave
        The mesh and its weave.
    settings : RibbonSettings
        Width and clearance.
    thickness_mm : (T,) float array
        Of each thread's material.
    laps : (N,) int array, optional
        The crossings at which a joint laps; before pieces are planned it may be any.
    narrowing : (P,) float array, optional
        Factor on the width at each pass.
    """
    height = crossing_heights(weave, thickness_mm, settings.clearance_mm, laps)
    length, portals, rule = settings.panel_share, source.portals, settings.width_rule
    mesh, halfedges = source.mesh, source.halfedges
    width: WidthRule | FloatArray = rule
    if rule.even:
        width = even_widths(mesh, halfedges, weave, rule, length=length, portals=portals)
    ribbons = project_ribbons(
        mesh,
        halfedges,
        weave,
        height_mm=height,
        length=length,
        width=width,
        narrowing=narrowing,
        portals=portals,
    )
    if isinstance(width, WidthRule):
        return smooth_ribbons(ribbons, settings.smooth)
    factor = np.ones(len(width)) if narrowing is None else narrowing
    ribbons = smooth_ribbons(short_panels(ribbons, weave, width, factor), settings.smooth)
    return even_rails(ribbons, weave, factor * width)


def keep_clear(
    woven: WovenObject,
    settings: RibbonSettings,
    supplies: Supplies,
    laps: IntArray | None = None,
    most: FloatArray | None = None,
) -> WovenObject:
    """Lay the ribbons of a woven object again, with room for laps where joints are.

    If the width is left to fabweave, they get narrower where they would be too near to others, and
    by no less than the factors ``most`` at each pass.
    """
    if woven.straight:
        return replace(woven, laps=laps)
    thickness = supplies.thickness_mm(woven.bunches)

    def lay(factor: FloatArray | None = None) -> Ribbons:
        return lay_ribbons(woven.source, woven.weave, settings, thickness, laps, factor)

    if not settings.width_rule.auto:
        return replace(woven, ribbons=lay(), laps=laps)
    limits = thread_limits(supplies, woven.bunches, settings.clearance_mm)
    narrowed = narrow_ribbons(lay, woven.weave, limits, most)
    return replace(woven, ribbons=narrowed.ribbons, laps=laps, narrowed=narrowed)


def check_object(
    woven: WovenObject,
    settings: RibbonSettings,
    supplies: Supplies,
    remake: Callable[[float], WovenObject] | None = None,
    depth: Depth = Depth.SEARCHED,
) -> RibbonCheck:
    """Check the ribbons of a woven object against their materials, and look for remedies.

    At another size joints may lie elsewhere, and widths be others: sizes are looked for with room
    for a lap everywhere, and then confirmed on what would be made there.

    Parameters
    ----------
    woven, settings, supplies
        What is checked.
    remake : callable, optional
        Plans its pieces and lays its ribbons for them at another size, in millimetres. Without it,
        they are taken to have room for a lap everywhere.
    depth : Depth
        How far the check goes.
    """
    limits = thread_limits(supplies, woven.bunches, settings.clearance_mm)
    thickness = supplies.thickness_mm(woven.bunches)
    narrowed = woven.narrowed

    def lay(size_mm: float, narrower: float, narrowest: bool) -> Ribbons:
        growth = size_mm / woven.size_mm
        source = _scaled(woven.source, growth)
        changed = settings.with_width(settings.width_rule.times(narrower))
        factor = None
        if narrowed is not None and growth == 1.0:
            factor = narrowed.factor
        elif narrowed is not None and narrowest:
            # At another size, what is too near will be narrowed as far as may be. Widths grow with
            # the size, unless they are bounded.
            if np.isfinite(settings.width_rule.most_mm):
                growth = 1.0
            factor, stuck = narrowed.factor.copy(), narrowed.stuck
            factor[stuck] = np.minimum(factor, narrowed.least / growth)[stuck]
        laps = woven.laps if size_mm == woven.size_mm else None
        return lay_ribbons(source, woven.weave, changed, thickness, laps, factor)

    def settle(size_mm: float, planned: bool) -> tuple[Ribbons, Nearness | None]:
        remade = remake(size_mm) if remake is not None and planned else None
        if remade is None:
            remade = keep_clear(resized(woven, size_mm), settings, supplies)
        if remade.narrowed is None:
            return remade.ribbons, measure_clearance(remade.ribbons, remade.weave, limits)[1]
        known = remade.narrowed.clearance
        return remade.ribbons, known[1] if known is not None else None

    return check_ribbons(
        woven.ribbons,
        woven.weave,
        woven.labels,
        limits,
        size_mm=woven.size_mm,
        lay=None if woven.straight else lay,
        clearance=narrowed.clearance if narrowed is not None else None,
        settle=settle,
        auto=narrowed is not None,
        clashing=_beside_clashes(woven) if woven.source.clashes else None,
        depth=depth,
    )


def _beside_clashes(woven: WovenObject) -> BoolArray:
    """Tell which crossings lie beside faces that run through other faces, (X,)."""
    halfedges = woven.halfedges
    clashing = flags(woven.mesh.n_faces, self_intersections(woven.mesh).ravel())
    here = woven.weave.threads.crossing_halfedge
    beside = halfedges.face[here], halfedges.face[halfedges.twin[here]]
    return np.asarray(clashing[beside[0]] | clashing[beside[1]])


def resized(woven: WovenObject, size_mm: float) -> WovenObject:
    """Return an object whose mesh has another largest dimension; its ribbons are not laid anew."""
    return replace(woven, source=_scaled(woven.source, size_mm / woven.size_mm))


def _scaled(source: LoadedMesh, factor: float) -> LoadedMesh:
    mesh = source.mesh
    return replace(source, mesh=PolyMesh(mesh.vertices * factor, mesh.offsets, mesh.indices))


def stiffness_check(
    woven: WovenObject, settings: RibbonSettings, supplies: Supplies
) -> RibbonCheck | None:
    """Return the check of an object for which a material is too stiff; None if none is.

    It goes no farther than is needed to say at which size the material would do.
    """
    limits = thread_limits(supplies, woven.bunches, settings.clearance_mm)
    if not is_too_stiff(measure_along(woven.ribbons, limits)["bend"]):
        return None
    return check_object(woven, settings, supplies, depth=Depth.ALONG)


def require_stiffness(
    woven: WovenObject,
    settings: RibbonSettings,
    supplies: Supplies,
    check: RibbonCheck | None = None,
) -> None:
    """Raise TooFineError if a material is too stiff for an object.

    Parameters
    ----------
    woven, settings, supplies
        What is checked.
    check : RibbonCheck, optional
        What :func:`stiffness_check` found, if that is known already.
    """
    check = check or stiffness_check(woven, settings, supplies)
    if check is not None:
        for finding in check.refused:
            index = int(supplies.of(woven.bunches)[woven.labels.index(finding.thread)])
            thinner = thinner_supply(supplies, index, finding.value)
            material = supplies.materials[index]
            formed = forming_advice(material, finding.value)
            require_pliable(check, material.description, thinner, formed)


def _narrowed_notes(woven: WovenObject) -> list[Note]:
    """Return a note on where ribbons were narrowed and why; none if they were nowhere."""
    if woven.narrowed is None or woven.narrowed.factor.min() >= 1:
        return []
    factor = woven.narrowed.factor
    apart = factor if woven.apart is None else woven.apart
    causes = {
        "to keep clear of one another": np.count_nonzero(apart < 1),
        "so as not to cross themselves when unfolded": np.count_nonzero(factor < apart),
    }
    places = {why: count for why, count in causes.items() if count}
    told = " and ".join(f"at {count} {why}" for why, count in places.items())
    note = (
        f"width: ribbons were narrowed at {np.count_nonzero(factor < 1)} of {len(factor)} "
        f"places, to {factor.min():.0%} at the least"
    )
    note += f", {next(iter(places))}" if len(places) == 1 else f": {told}"
    return [Note("width", note, detail=True)]


def _even_notes(woven: WovenObject, settings: RibbonSettings) -> list[Note]:
    """Return a note on the one width of ribbons, if they have one."""
    if not settings.width_rule.even or not len(woven.ribbons.entry):
        return []
    width = measure_bends(woven.ribbons).width_mm[woven.ribbons.entry]
    widest, least = float(width.max()), float(width.min())
    share = float(np.mean(width > _AS_WIDE * widest))
    note = f"width: ribbons are {widest:.1f} mm wide at {share:.0%} of all crossings"
    note += f", down to {least:.1f} mm where there is less room" if share < 1 else ""
    return [Note("width", note, detail=True)]


def opening_notes(woven: WovenObject) -> list[Note]:
    """Return a note on tips where ribbons are slivers, and on what opens the mesh there."""
    # Faces have the numbers that the option takes only where none were left out or divided.
    plain = not woven.source.openings and not woven.source.n_old_vertices
    return tip_notes(woven.mesh, woven.halfedges, woven.ribbons, offer=plain)


def require_wide(woven: WovenObject) -> None:
    """Raise TooFineError if a ribbon is too narrow to be cut, and say what would help."""
    try:
        require_width(woven.ribbons, woven.labels, woven.size_mm)
    except TooFineError as error:
        cures = ". ".join([error.cure, *opening_notes(woven)])
        raise TooFineError(error.reason, cures) from None


def width_notes(woven: WovenObject, settings: RibbonSettings, supplies: Supplies) -> list[Note]:
    """Return notes on where ribbons were narrowed, and how wide they could be throughout."""
    mesh, halfedges = woven.mesh, woven.halfedges
    notes = _even_notes(woven, settings) + _narrowed_notes(woven)
    if woven.straight:
        return notes
    limits = thread_limits(supplies, woven.bunches, settings.clearance_mm)
    thickness = supplies.thickness_mm(woven.bunches)
    room = widest_width(
        mesh,
        halfedges,
        woven.weave,
        length=settings.panel_share,
        portals=woven.source.portals,
    )

    def lay(width_mm: float) -> Ribbons:
        changed = settings.with_width(WidthRule(least_mm=width_mm, most_mm=width_mm))
        return lay_ribbons(woven.source, woven.weave, changed, thickness, woven.laps)

    widest = widest_clear(lay, woven.weave, limits, room)
    if widest is None:
        fit = (
            f"do not fit: even at {np.max(limits.width_mm):g} mm, the least that can be handled, "
            "they lack room or come too close to one another"
        )
    else:
        # Rounded down, so that the width in the note has room.
        fit = f"fit, and keep clear of one another, up to {int(widest * 100) / 100:g} mm"
    share = open_share(woven.ribbons, woven.weave, mesh)
    return [
        *notes,
        Note("width", f"width: ribbons of constant width {fit}", detail=True),
        *opening_notes(woven),
        Note("openings", f"openings: {share:.0%} of the surface stays open", detail=True),
    ]
