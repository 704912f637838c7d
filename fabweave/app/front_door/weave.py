"""Weave a mesh, and say what came of it."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fabweave.app.front_door.look import length_mm
from fabweave.app.front_door.mesh import Mesh, stations_of
from fabweave.app.front_door.notebook import face
from fabweave.app.front_door.ribbons import Ribbons
from fabweave.app.front_door.stations import Stations, there, with_ribbons, woven
from fabweave.app.front_door.yarns import Yarns
from fabweave.app.woven_mesh import WovenMesh
from fabweave.core.arrays import BoolArray, IntArray, frozen, frozen_value

if TYPE_CHECKING:
    from PIL import Image


class Thread(NamedTuple):
    """One thread of a weave.

    ``crossings`` are the numbers of the crossings that it passes, in walking order, (n,), and
    ``over`` whether it lies on top there, (n,). A closed thread is a ring.
    """

    label: str
    closed: bool
    bunch: int
    crossings: IntArray
    over: BoolArray

    def __repr__(self) -> str:
        kind = "ring" if self.closed else "thread with two ends"
        return f"Thread({self.label}: {kind}, {len(self.crossings)} crossings)"


@frozen_value
class Weave:
    """A woven mesh: which threads there are, and which lies on top where two cross.

    Made by :func:`fabweave.weave`; :meth:`ribbons` goes on from here.
    """

    stations: Stations
    mesh: Mesh

    @property
    def woven(self) -> WovenMesh:
        """The station that stands behind this, as the pipeline hands it on."""
        return there(self.stations.weave)

    @property
    def pattern(self) -> str:
        """The pattern, such as ``"twill"``."""
        return self.woven.weave.pattern

    @property
    def threads(self) -> tuple[Thread, ...]:
        """The threads, in the order of their names."""
        threads, over = self.woven.weave.threads, self.woven.weave.over
        bounds = threads.offsets.tolist()
        return tuple(
            Thread(
                label,
                bool(threads.closed[number]),
                int(self.woven.bunches[number]),
                threads.crossing[bounds[number] : bounds[number + 1]],
                over[bounds[number] : bounds[number + 1]],
            )
            for number, label in enumerate(self.woven.labels)
        )

    @property
    def crossings(self) -> IntArray:
        """The mesh edge on which each crossing lies, as two vertices, (X, 2)."""
        halfedges = self.woven.halfedges
        first = self.woven.weave.threads.crossing_halfedge
        return frozen(np.column_stack((halfedges.tail[first], halfedges.head[first])))

    @property
    def exact(self) -> bool:
        """Whether the pattern holds everywhere."""
        return self.woven.weave.exact

    @property
    def reason(self) -> str | None:
        """Why there is no exact twill on this mesh; None where the pattern is exact."""
        twill = self.woven.result.twill
        if twill is None or twill.obstruction is None:
            return None
        return twill.obstruction.text

    @property
    def broken(self) -> dict[str, int]:
        """How many conditions of the pattern are broken, by kind: edge, face, vertex."""
        broken = self.woven.weave.broken
        return {"edge": broken.edge, "face": broken.face, "vertex": broken.vertex}

    @property
    def notes(self) -> tuple[str, ...]:
        """What is worth knowing about the mesh and its weave."""
        return (*self.woven.source.notes, *self.woven.result.notes)

    def ribbons(self, **options: Any) -> Ribbons:
        """Lay a ribbon along every thread.

        Parameters
        ----------
        options
            As on the command line: ``material="card"``, ``thickness="0.4mm"``, ``width="12mm"``,
            ``open=0.2``, ``smooth=3``, ``crossing=0.7``, ``clearance="0.1mm"``.

        Returns
        -------
        Ribbons
            With room for two layers at each crossing, and for three, where a joint may lie.

        Raises
        ------
        InputError
            If the material is not known, or an option is wrong.

        Examples
        --------
        >>> import fabweave as fw
        >>> fw.weave(fw.shape("octahedron", size="200mm")).ribbons(width="9mm")
        Ribbons(Octahedron: 4 ribbons in Card, 300 g/m², 0.4 mm, 8.9 to 9.0 mm wide, 1.57 m in all)
        """
        stations = with_ribbons(self.stations, options)
        return Ribbons(stations, Weave(stations, Mesh(stations)))

    def yarns(self, *, radius: Any = None, sides: int = 12) -> Yarns:
        """Spin a yarn along every thread, for pictures and for printing.

        Parameters
        ----------
        radius : length, optional
            One radius for all; by default, the thickest that have room.
        sides : int
            Sides of the tubes.

        Raises
        ------
        InputError, CannotMakeError
            If yarns of this radius have no room, or radius or sides make no sense.

        Examples
        --------
        >>> import fabweave as fw
        >>> fw.weave(fw.shape("tetrahedron", size="60mm")).yarns(radius="3mm")
        Yarns(Tetrahedron: 3 yarns, 3.00 to 3.00 mm in radius)
        """
        from fabweave.app.model_job import YarnOptions, spin_object  # noqa: PLC0415

        stations = with_ribbons(self.stations, {})
        options = YarnOptions(None if radius is None else length_mm(radius), sides)
        return Yarns(stations, spin_object(there(stations.ribbons), options))

    def picture(self, **look: Any) -> "Image.Image":
        """Return a picture of the woven object, with ribbons as they come in card.

        The arguments are those of ``Ribbons.picture``.
        """
        return self.ribbons().picture(**look)

    def __repr__(self) -> str:
        return f"Weave({self.woven.title}: {self._kind()}, {self._counts()})"

    def _kind(self) -> str:
        if self.exact:
            return f"exact {self.pattern}"
        return f"{self.pattern} with {self.woven.weave.broken.total} broken conditions"

    def _counts(self) -> str:
        threads = self.woven.weave.threads
        return f"{threads.n_threads} threads, {threads.n_crossings} crossings"

    def _repr_html_(self) -> str:
        threads = self.woven.weave.threads
        figures: dict[str, Any] = {
            "weave": self._kind(),
            "threads": threads.n_threads,
            "crossings": threads.n_crossings,
        }
        if self.reason:
            figures["why not exact"] = self.reason
        return face(self.woven.title, figures, self.picture())


def weave(mesh: Any, **options: Any) -> Weave:
    """Weave a mesh.

    Parameters
    ----------
    mesh : Mesh, path, or anything with vertices and faces
    options
        As on the command line: ``pattern="twill"`` (plain, twill, triaxial, ``"3/1"``,
        ``"satin:5/2"``), ``boundary="turn"``, ``course="straight"``, ``twists="edges.csv"``,
        ``effort="best"``, ``seed=1``.

    Raises
    ------
    InputError
        If the mesh or an option is bad.
    CannotMakeError
        If the pattern cannot be woven on this mesh, and why.

    References
    ----------
    E. Akleman, J. Chen, Y. Chen, Q. Xing, J. L. Gross, "Cyclic twill-woven objects", Computers &
    Graphics 35 (2011), section 5; an m × n quad torus has 2·gcd(m, n) threads.

    Examples
    --------
    >>> import fabweave as fw
    >>> twill = fw.weave(fw.shape("torus", m=8, n=4), pattern="twill")
    >>> twill
    Weave(Torus, 8 by 4: exact twill, 8 threads, 64 crossings)
    >>> twill.threads[0].over[:8].tolist()
    [False, True, True, False, False, True, True, False]
    """
    stations = woven(stations_of(mesh, options), options)
    return Weave(stations, Mesh(stations))
