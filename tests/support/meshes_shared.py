"""Find the real meshes beside the repository, and what is known about them."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.upright import resize_mesh

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "meshes"


@dataclass(frozen=True)
class KnownMesh:
    """One row of the table beside the meshes; None where the table is blank."""

    name: str
    n_vertices: int
    n_edges: int
    n_faces: int
    face_sizes: tuple[tuple[int, int], ...]
    genus: tuple[int, ...] | None
    n_components: int
    n_boundary_loops: int
    manifold: bool
    oriented: bool
    strands: int | None

    @property
    def path(self) -> Path:
        return FOLDER / self.name

    @property
    def bad(self) -> bool:
        return self.name.startswith("bad/")


def _row(line: str) -> KnownMesh:
    cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
    counts = [int(cell) for cell in cells[1].split("/")]
    sizes = tuple(tuple(map(int, pair.split(":"))) for pair in cells[2].split())
    genus = tuple(int(word) for word in cells[3].strip("[]").split(",")) if cells[3] else None
    return KnownMesh(
        cells[0],
        counts[0],
        counts[1],
        counts[2],
        sizes,
        genus,
        int(cells[4]),
        int(cells[5]),
        cells[6] == "yes",
        cells[7] == "yes",
        int(cells[8]) if cells[8] else None,
    )


def known_meshes() -> list[KnownMesh]:
    """Return all rows of the table, or none where the folder is absent."""
    table = FOLDER / "README.md"
    if not table.is_file():
        return []
    lines = table.read_text(encoding="utf-8").splitlines()
    rows = [line for line in lines if line.startswith("|") and line.split("|")[1].count("/") == 1]
    return [_row(line) for line in rows]


def mesh_params(*, bad: bool | None = None) -> list:
    """Return one pytest parameter a mesh; a single skipped one where the folder is absent."""
    rows = [row for row in known_meshes() if bad is None or row.bad == bad]
    if not rows:
        reason = f"the shared meshes are not at {FOLDER.parent.name}/{FOLDER.name}"
        return [pytest.param(None, marks=pytest.mark.skip(reason=reason), id="absent")]
    return [pytest.param(row, id=row.name) for row in rows]


def shared_mesh(name: str) -> Path:
    """Return the path of one mesh; skip the test where it is absent."""
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(f"the shared mesh {name} is not beside the repository")
    return path


def real_mesh(name: str, size_mm: float | None = None) -> PolyMesh:
    """Return one mesh, fit to be woven, at a size; skip the test where it is absent."""
    return resize_mesh(prepare_mesh(read_mesh(shared_mesh(name)).mesh)[0], size_mm=size_mm)[0]


SPOT = "quad/spot_quadrangulated.obj"
