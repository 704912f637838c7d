"""Input files of every kind, spoilt by a seed, and what reads them."""

import io
import random
import shutil
import traceback
import zipfile
from collections.abc import Callable
from pathlib import Path

import ezdxf
import tomli_w
from mesh_writers import binary_ply, off_bytes, ply_bytes, write_mesh

from fabweave.core.errors import FabweaveError
from fabweave.job.coupon import coupon_for
from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.options.settings import settings_from_job
from fabweave.options.table import option_named
from fabweave.plan.crossing_map import read_crossing_map
from fabweave.sheet.presets import preset_named

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STOCK = """
[[sheet]]
name = "ply"
size = "600x400mm"
quantity = 3
price = 4.5
grain = 90
material = "card:dark red"
defects = [{x = 5, y = 5, diameter = 9}, {polygon = [[20, 20], [40, 20], [30, 50]]}]

[[offcut]]
outline = "offcut.dxf"

[[offcut]]
outline = [[0, 0], [100.5, 0], [0, 80]]
"""
#: What is put in the place of a number, a word, or a value.
ODD = (
    "-1", "0", "1e400", "-1e308", "nan", "inf", "1" * 400, "9" * 5000, "0x" + "f" * 6000, "true",
    '"text"', '""', "[]", "[[1]]", "{}", "null", "[" * 3000, "[" * 200 + "]" * 200,
    '{"a":' * 500, "4294967296", "9223372036854775808", "1.5", "\ud800".encode("utf-8", "replace"),
    "\0", "\N{SNOWMAN}", "2024-01-01", "a." * 3000 + "a",
)  # fmt: skip


def spoilt(data: bytes, draw: random.Random) -> bytes:
    """Return bytes of a file with a few things wrong."""
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        at = draw.randrange(len(data) + 1)
        kind = draw.randrange(8)
        if kind == 0:
            data = data[:at]
        elif kind == 1:
            end = min(at + draw.choice((1, 2, 8, 100)), len(data))
            data = data[:at] + data[end:]
        elif kind == 2:
            data = data[:at] + bytes(draw.randrange(256) for _ in range(4)) + data[at + 4 :]
        elif kind == 3:
            end = min(at + draw.choice((10, 100, 1000)), len(data))
            data = data[:at] + data[at:end] * 3 + data[end:]
        else:
            data = _odd_value(data, at, draw)
    return data


def _odd_value(data: bytes, at: int, draw: random.Random) -> bytes:
    """Put an odd value in the place of a number, a word or a quoted text near a place."""
    word = b'-+.0123456789"_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'
    start = at
    while start < len(data) and data[start] not in word:
        start += 1
    end = start
    while end < len(data) and data[end] in word:
        end += 1
    odd = draw.choice(ODD)
    return data[:start] + (odd if isinstance(odd, bytes) else odd.encode()) + data[end:]


class Kinds:
    """A sound file of each kind in a folder, and what reads it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.job = folder / "job"
        run_job(Stations.read("shape:tetrahedron", {"size": 120, "effort": "quick"}), self.job)
        mesh = parse_shape("shape:cube")
        write_mesh(folder / "cube.obj", mesh)
        (folder / "cube.off").write_bytes(off_bytes(mesh))
        (folder / "cube.ply").write_bytes(ply_bytes(mesh))
        (folder / "binary.ply").write_bytes(binary_ply(mesh))
        import trimesh  # noqa: PLC0415 -- takes long

        box = trimesh.creation.box()
        for kind in ("stl", "glb", "3mf"):
            (folder / f"box.{kind}").write_bytes(box.export(file_type=kind))
        (folder / "text.stl").write_text(box.export(file_type="stl_ascii"))
        for name, data in box.export(file_type="gltf").items():
            (folder / name.replace("model", "box")).write_bytes(data)
        drawing = ezdxf.new("R2010", units=4)
        drawing.modelspace().add_lwpolyline(
            [(0, 0, 0.1), (90, 0, 0), (90, 60, 0), (0, 60, 0)], format="xyb", close=True
        )
        drawing.modelspace().add_circle((30, 30), 9)
        drawing.saveas(folder / "offcut.dxf")
        for name in ("materials.toml", "targets.toml"):
            shutil.copy(EXAMPLES / name, folder)
        (folder / "stock.toml").write_text(STOCK)
        (folder / "preset.toml").write_text(tomli_w.dumps(preset_named("lightburn").table))

    def readers(self) -> dict[str, tuple[Path, Callable[[Path], object]]]:
        """Return for each kind the sound file, and what reads a spoilt one."""
        found: dict[str, tuple[Path, Callable[[Path], object]]] = {
            path.name: (path, read_whole_mesh)
            for path in sorted(self.folder.iterdir())
            if path.suffix[1:] in ("obj", "off", "ply", "stl", "glb", "gltf", "3mf")
        }
        options = {"stock": "stock", "materials": "library", "targets": "rules", "preset": "preset"}
        for name, option in options.items():
            kind = option_named(option).kind
            found[f"{name}.toml"] = (
                self.folder / f"{name}.toml",
                lambda path, kind=kind: kind.parse(str(path)),
            )
        found["offcut.dxf"] = (self.folder / "offcut.dxf", self._outline)
        found["job.toml"] = (self.job / "job.toml", self._settings)
        for name in ("crossing_map.json", "ribbons.json"):
            found[name] = (self.job / name, self._of_job)
        found["layout"] = (self.job / "crossing_map.json", read_crossing_map)
        return found

    def lay_out(self, place: Path) -> None:
        """Put into a folder what spoilt files name beside them."""
        for path in (self.folder / "offcut.dxf", *self.folder.glob("*.bin")):
            (place / path.name).write_bytes(path.read_bytes())

    def require_sound(self, place: Path) -> None:
        """Raise what reading the sound files raises: nothing is learned from broken ones."""
        for sound, read in self.readers().values():
            (place / sound.name).write_bytes(sound.read_bytes())
            read(place / sound.name)

    def _outline(self, path: Path) -> None:
        list_of = path.with_name("stock.toml")
        list_of.write_text(f"[[offcut]]\noutline = '{path.name}'\n")
        option_named("stock").kind.parse(str(list_of))

    def _settings(self, path: Path) -> None:
        settings_from_job(path)
        self._of_job(path)

    def _of_job(self, path: Path) -> None:
        for name in ("job.toml", "crossing_map.json", "ribbons.json"):
            if name != path.name:
                (path.parent / name).write_bytes((self.job / name).read_bytes())
        coupon_for(path.parent)


def read_whole_mesh(path: Path) -> None:
    """Read a mesh as a job does, up to the weaving."""
    mesh = read_mesh(path).mesh
    mesh, _, _ = prepare_mesh(mesh)
    if mesh.n_faces < 1000:
        self_intersections(mesh)


def try_one(reader: tuple[Path, Callable[[Path], object]], folder: Path, seed: str) -> str:
    """Spoil a file and read it; return what came of it: ``read``, ``refused``, or a traceback."""
    sound, read = reader
    draw = random.Random(seed)  # noqa: S311 -- tries, not secrets
    data = sound.read_bytes()
    if sound.suffix == ".3mf" and draw.random() < 0.7:
        data = _repacked(data, draw)
    else:
        data = spoilt(data, draw)
    place = folder / sound.name
    place.write_bytes(data)
    try:
        read(place)
    except FabweaveError as error:
        return "refused" if str(error).strip() else "refused without a word"
    except BaseException:
        return traceback.format_exc()
    return "read"


def _repacked(data: bytes, draw: random.Random) -> bytes:
    """Spoil one file in an archive."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    name = max(files, key=lambda one: len(files[one]))
    files[name] = spoilt(files[name], draw)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for one, content in files.items():
            archive.writestr(one, content)
    return packed.getvalue()
