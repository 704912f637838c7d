"""Find the motions that map small meshes onto themselves by trying all, and check one by places."""

import numpy as np
from scipy.spatial import cKDTree

from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh


def all_motions(mesh: PolyMesh, twist: dict | None = None) -> list[np.ndarray]:
    """Return the matrices of all motions of a mesh that use all its vertices, one a place.

    ``twist`` has the twist of each edge between two faces, a pair of vertices in order: only
    motions are returned then that keep the twists, or negate them if they are reflections.
    """
    corners = mesh.vertices[mesh.indices]
    centre, points = corners.mean(axis=0), mesh.vertices
    places = points - centre
    size = np.ptp(points, axis=0).max()
    radius = np.linalg.norm(places, axis=1)
    areas = np.linalg.norm(np.cross(places[:, None], places[None]), axis=2)
    a, b = np.unravel_index(np.argmax(areas > 0.05 * size**2), areas.shape)
    frame = np.stack((places[a], places[b], np.cross(places[a], places[b])), axis=1)
    tree = cKDTree(places)
    faces = {_ring(face) for face in mesh.faces()}
    found = []
    near = [np.flatnonzero(np.abs(radius - radius[k]) < 1e-6 * size) for k in (a, b)]
    for c in near[0]:
        for d in near[1]:
            if abs(places[c] @ places[d] - places[a] @ places[b]) > 1e-6 * size**2:
                continue
            for sign in (1, -1):
                normal = sign * np.cross(places[c], places[d])
                matrix = np.stack((places[c], places[d], normal), axis=1) @ np.linalg.inv(frame)
                off, image = tree.query(places @ matrix.T)
                if off.max() > 1e-6 * size:
                    continue
                moved = [[int(image[v]) for v in face] for face in mesh.faces()]
                same = {_ring(face) for face in moved} == faces
                turned = {_ring(face[::-1]) for face in moved} == faces
                if not (same or turned):
                    continue
                if twist is None or all(
                    twist[tuple(sorted((int(image[v]), int(image[w]))))] == (sense == (sign > 0))
                    for (v, w), sense in twist.items()
                ):
                    found.append(matrix)
    return found


def _ring(face: list[int]) -> tuple[int, ...]:
    least = face.index(min(face))
    return tuple(face[least:] + face[:least])


def pass_places(mesh: PolyMesh, halfedges: Halfedges, weave) -> np.ndarray:
    """Return three places of each pass, (P, 3, 3): at its crossing, before it and after it.

    The first is above or below the edge's middle, as the weave has it.
    """
    threads = weave.threads
    tail, head = mesh.vertices[halfedges.tail], mesh.vertices[halfedges.head]
    count = np.bincount(halfedges.face)
    centres, areas = (
        np.stack([np.bincount(halfedges.face, weights=column) for column in values.T], axis=1)
        for values in (tail, np.cross(tail, head))
    )
    centres /= count[:, None]
    here = threads.halfedge
    one, other = halfedges.face[here], halfedges.face[halfedges.twin[here]]
    # The vector areas of both faces point outwards.
    up = areas[one] + areas[other]
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    rise = 0.02 * np.linalg.norm(head - tail, axis=1)[here]
    at = (tail + head)[here] / 2 + up * (np.where(weave.over, 1, -1) * rise)[:, None]
    # A strand that arrives forward comes from the corner at the tail, on the left, and goes to
    # the head, on the right.
    forward = threads.forward[:, None]
    before = (np.where(forward, tail[here], head[here]) + centres[one]) / 2
    after = (np.where(forward, head[here], tail[here]) + centres[other]) / 2
    return np.stack((at, before, after), axis=1)
