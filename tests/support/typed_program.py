"""A program that uses all of the front door: pyright holds it to its types, strictly."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import fabweave as fw


def main(folder: Path) -> None:
    """Go from a mesh to folders, by every function."""
    mesh: fw.Mesh = fw.shape("torus", m=8, n=4, size="300mm")
    read = fw.mesh(mesh.vertices, mesh.faces, size=300.0)
    weave: fw.Weave = fw.weave(read, pattern="twill")
    thread: fw.Thread = weave.threads[0]
    ribbons: fw.Ribbons = weave.ribbons(material="card")
    pieces: fw.Pieces = ribbons.pieces(max_length="300mm", joint="rivet")
    layout: fw.Layout = pieces.nest(sheet="600x400mm", effort="quick")
    job: fw.WrittenJob = layout.write(folder / "torus", kerf="0.15mm")
    proof: fw.VerifyReport = fw.verify(job.folder)
    report: fw.Inspection = fw.inspect(mesh, designs=3)
    with ThreadPoolExecutor() as executor:
        best: fw.Design = fw.design(mesh, tries=3, goal="hours=5", executors=executor)[0]
        made = fw.make("cow.obj", folder / "cow", pieces=150, executors=executor, size="400mm")
        done: fw.WrittenBatch = fw.batch({"a": {"mesh": mesh}}, folder, executors=executor)
    lines: list[str] = [thread.label, report.text, best.name, *done.made, *made.notes]
    hours: float = max(best.figures.hours or (0.0,)) + made.costs.assembly.hours[1]
    areas: list[float] = [polygon.area for polygon in pieces.polygons]
    print(proof.ok, lines, hours, sum(areas), weave.yarns(radius=2.0).radius_mm, mesh.size_mm[0])


if __name__ == "__main__":
    try:
        main(Path("out"))
    except (fw.InputError, fw.CannotMakeError) as error:
        print(error)
