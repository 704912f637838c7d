"""Cut a surface of triangles along levels of a function, and part it into tubes at its saddles."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.mesh.halfedge import Halfedges, group_edges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import label_links


def find_saddles(half: Halfedges, height: FloatArray, n_vertices: int) -> list[int]:
    """Return the inner vertices around which a function rises and falls twice; lowest first.

    Parameters
    ----------
    half : Halfedges
        Of triangles.
    height : (V,) float array
        No two neighbours inside are as high.
    n_vertices : int

    Raises
    ------
    ValueError
        If there is a maximum or minimum, or a vertex around which it rises three times.
    """
    higher = height[half.head] > height[half.tail]
    # Around a vertex: from the edge that leaves to the one that came before it, in its face.
    before = height[half.tail[half.prev]] > height[half.tail]
    changes = np.bincount(half.tail, weights=higher != before, minlength=n_vertices)
    inner = np.ones(n_vertices, dtype=bool)
    inner[half.tail[half.twin < 0]] = inner[half.head[half.twin < 0]] = False
    if np.any(changes[inner] > 4):
        raise ValueError("a vertex is more than a saddle")
    saddles = np.flatnonzero(inner & (changes == 4))
    return [int(v) for v in saddles[np.argsort(height[saddles], kind="stable")]]


@frozen_value
class CutSurface:
    """Triangles with lines along which they are cut.

    Parameters
    ----------
    points : (V, 3) float array
    height : (V,) float array
    triangles : (T, 3) int array
    lines : (L, 2) int array
        Cut edges.
    """

    points: FloatArray
    height: FloatArray
    triangles: IntArray
    lines: IntArray

    @property
    def cut(self) -> BoolArray:
        """Which sides of triangles are cut, (3 T,)."""
        count = len(self.points)
        tail, head = self.triangles.reshape(-1), np.roll(self.triangles, -1, axis=1).reshape(-1)
        low, high = np.minimum(tail, head), np.maximum(tail, head)
        ends = np.sort(self.lines, axis=1)
        return np.isin(low * count + high, ends[:, 0] * count + ends[:, 1])


def cut_at(surface: CutSurface, level: float, start: BoolArray) -> CutSurface:
    """Cut a surface along a level: all of it that hangs together with some triangles.

    Parameters
    ----------
    surface : CutSurface
        No vertex is on the level but such as the cut is to pass.
    level : float
    start : (T,) bool array
        Some of the triangles that the level crosses.
    """
    triangles = surface.triangles
    above = np.sign(surface.height - level).astype(np.int64)[triangles]
    crossed = np.flatnonzero((above.min(axis=1) < 0) & (above.max(axis=1) > 0))
    near = triangles[crossed]
    head = np.roll(near, -1, axis=1)
    straddles = above[crossed] * np.roll(above[crossed], -1, axis=1) < 0
    low, high = np.minimum(near, head), np.maximum(near, head)
    code = np.where(straddles, low * len(surface.points) + high, -1)
    edges, number = np.unique(code[straddles], return_inverse=True)
    of_side = np.full(code.shape, -1)
    of_side[straddles] = number.reshape(-1)
    # Triangles and edges hang together.
    row = np.nonzero(straddles)[0]
    _, label = label_links(row, len(crossed) + number.reshape(-1), len(crossed) + len(edges))
    wanted = np.unique(label[: len(crossed)][start[crossed]])
    part = np.isin(label[: len(crossed)], wanted)
    used = np.unique(of_side[part][of_side[part] >= 0])
    a, b = np.divmod(edges[used], len(surface.points))
    share = ((level - surface.height[a]) / (surface.height[b] - surface.height[a]))[:, None]
    new_points = surface.points[a] + share * (surface.points[b] - surface.points[a])
    new_of = np.full(len(edges), -1)
    new_of[used] = len(surface.points) + np.arange(len(used))
    pieces: list[tuple[int, int, int]] = []
    lines: list[tuple[int, int]] = []
    for face, sides in zip(near[part].tolist(), of_side[part].tolist(), strict=True):
        at = [k for k in range(3) if sides[k] >= 0]
        middle = [int(new_of[s]) if s >= 0 else -1 for s in sides]
        if len(at) == 1:
            k = at[0]
            one, two, lone = face[k], face[(k + 1) % 3], face[(k + 2) % 3]
            pieces += [(one, middle[k], lone), (middle[k], two, lone)]
            lines.append((middle[k], lone))
        else:
            # The corner that both crossed sides share is alone on its side of the level.
            k = next(k for k in range(3) if sides[k] >= 0 and sides[(k + 2) % 3] >= 0)
            lone, two, three = face[k], face[(k + 1) % 3], face[(k + 2) % 3]
            first, last = middle[k], middle[(k + 2) % 3]
            pieces += [(lone, first, last), (first, two, three), (first, three, last)]
            lines.append((first, last))
    kept = np.ones(len(triangles), dtype=bool)
    kept[crossed[part]] = False
    return CutSurface(
        np.concatenate([surface.points, new_points]),
        np.concatenate([surface.height, np.full(len(used), level)]),
        np.concatenate([triangles[kept], np.array(pieces, dtype=np.int64).reshape(-1, 3)]),
        np.concatenate([surface.lines, np.array(lines, dtype=np.int64).reshape(-1, 2)]),
    )


@frozen_value
class Part:
    """A part of a cut surface.

    Parameters
    ----------
    mesh : PolyMesh
        Triangles; a vertex at which the part touches itself is there twice.
    vertex : (V,) int array
        Which vertex of the whole each is.
    """

    mesh: PolyMesh
    vertex: IntArray


def parts_of(surface: CutSurface) -> list[Part]:
    """Return the parts into which a surface is cut."""
    mesh = PolyMesh.from_triangles(surface.points, surface.triangles)
    one, two = group_edges(mesh).pairs
    cut = surface.cut
    joined = ~cut[one]
    one, two = one[joined], two[joined]
    face = np.arange(mesh.n_corners) // 3
    n_parts, part = label_links(face[one], face[two], mesh.n_faces)
    after = face * 3 + (np.arange(mesh.n_corners) + 1) % 3
    # The tail of a side is the head of its twin.
    links = np.concatenate([one, after[one]]), np.concatenate([after[two], two])
    corner = label_links(*links, mesh.n_corners)[1]
    found = []
    for name in range(n_parts):
        own = corner.reshape(-1, 3)[part == name]
        names, number = np.unique(own, return_inverse=True)
        origin = np.empty(len(names), dtype=np.int64)
        origin[number.reshape(-1)] = surface.triangles[part == name].reshape(-1)
        found.append(
            Part(PolyMesh.from_triangles(surface.points[origin], number.reshape(-1, 3)), origin)
        )
    return found


def saddle_cuts(
    points: FloatArray, triangles: IntArray, height: FloatArray, saddles: list[int]
) -> CutSurface:
    """Cut a surface along the level of each saddle, where it hangs together with the saddle."""
    surface = CutSurface(points, height, triangles, np.zeros((0, 2), dtype=np.int64))
    for saddle in saddles:
        around = np.any(surface.triangles == saddle, axis=1)
        surface = cut_at(surface, float(surface.height[saddle]), around)
    return surface
