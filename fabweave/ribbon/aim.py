"""Hold what an object is to settle onto, where it is not the mesh that is woven."""

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.mesh.polymesh import PolyMesh


@frozen_value
class Aim:
    """What an object settles onto, where the mesh that is woven was moved for that.

    Parameters
    ----------
    mesh : PolyMesh
        As it was before: it has the faces of the one that is woven.
    places : (X, 3) float array
        Where crossings lie on it.
    drawn_mm : (X,) float array
        How far each would be from there in the end, if that mesh were woven.
    left_mm : (X,) float array
        How far each is to be now.
    moved_mm : float
        How far vertices of the mesh that is woven are from it at most.
    """

    mesh: PolyMesh
    places: FloatArray
    drawn_mm: FloatArray
    left_mm: FloatArray
    moved_mm: float

    def part(self, own: IntArray, mesh: PolyMesh) -> "Aim":
        """Return what the body of some crossings settles onto, which has a part of the mesh."""
        at = {name: getattr(self, name)[own] for name in ("places", "drawn_mm", "left_mm")}
        return Aim(mesh=mesh, moved_mm=self.moved_mm, **at)
