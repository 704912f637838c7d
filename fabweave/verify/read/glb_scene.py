"""Require that a model's scene is as plain as ours: programs walk it, and draw what they find."""

from typing import Any

from fabweave.verify.drawing import ReadError

_TOP = {"scene", "scenes", "asset", "accessors", "meshes", "materials", "nodes", "buffers",
        "bufferViews"}  # fmt: skip
_NODE = {"name", "mesh", "extras"}
_MESH = {"name", "extras", "primitives"}
_PRIMITIVE = {"attributes", "indices", "mode", "material"}
_MATERIAL = {"name", "pbrMetallicRoughness", "doubleSided"}
_PAINT = {"baseColorFactor", "roughnessFactor", "metallicFactor"}


def require_plain(document: dict[str, Any]) -> None:
    """Require one scene that shows every node as it stands, in opaque paint.

    Raises
    ------
    ReadError
        If there is anything that may move, hide, dress or replace what is drawn.
    """
    _require_only(document, _TOP, "the model")
    scenes, nodes = document["scenes"], document["nodes"]
    if document.get("scene") != 0 or len(scenes) != 1:
        raise ReadError(f"it has {len(scenes)} scenes, and shows scene {document.get('scene')}")
    _require_only(scenes[0], {"name", "nodes"}, "the scene")
    if sorted(scenes[0]["nodes"]) != list(range(len(nodes))):
        raise ReadError("its scene does not show every node, each once")
    for node in nodes:
        _require_only(node, _NODE, f"node {node.get('name')!r}")
    if sorted(node["mesh"] for node in nodes) != list(range(len(document["meshes"]))):
        raise ReadError("its nodes do not show every mesh, each once")
    for mesh in document["meshes"]:
        _require_only(mesh, _MESH, f"mesh {mesh.get('name')!r}")
        for primitive in mesh["primitives"]:
            _require_only(primitive, _PRIMITIVE, f"mesh {mesh.get('name')!r}")
            _require_only(primitive["attributes"], {"POSITION", "NORMAL", "COLOR_0"}, "a primitive")
    for material in document.get("materials", []):
        _require_only(material, _MATERIAL, "a material")
        paint = material["pbrMetallicRoughness"]
        _require_only(paint, _PAINT, "a material")
        if paint.get("baseColorFactor", [1.0] * 4)[3] != 1.0 or not material.get("doubleSided"):
            raise ReadError("a material can be seen through, or from one side only")
    if len(document["buffers"]) != 1 or "uri" in document["buffers"][0]:
        raise ReadError("its data are not all in the file")


def _require_only(thing: dict[str, Any], allowed: set[str], what: str) -> None:
    strange = sorted({*thing} - allowed)
    if strange:
        raise ReadError(f"{what} has {', '.join(strange)}, which our models do not need")
