"""What mesh files that are scenes stand for, before a library unfolds them: meshes may be named again and again.

Layouts: glTF 2.0, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html; COLLADA 1.4.1,
https://www.khronos.org/files/collada_spec_1_4.pdf.
"""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..exceptions import FileFormatError

_HEAD = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
MAX_NESTED = 16
"""Most references of a COLLADA file to nodes elsewhere in it: twenty that name each other stand for a million."""
MAX_CORNERS = 20_000_000
"""Most values of vertices and corners of triangles that a GLB file stands for."""
MAX_GEOMETRY_BYTES = 400_000_000
"""Most text of geometries that a COLLADA file stands for."""


def check_scene(path: Path, data: bytes) -> None:
    """Check that a GLB or COLLADA file stands for no more than can be held in memory; other files stand for themselves.

    Args:
        path: The file.
        data: Its content.

    Raises:
        FileFormatError: If it does, or its header is none.
    """
    suffix, size = path.suffix.lower(), 0
    try:
        if suffix == ".glb":
            size = _glb_corners(data) * MAX_GEOMETRY_BYTES // MAX_CORNERS
        elif suffix == ".dae":
            size = _dae_bytes(data)
    except ValueError as error:
        raise FileFormatError(path, f"is not a valid {suffix[1:].upper()} mesh: {error}") from None
    if size > MAX_GEOMETRY_BYTES:
        raise FileFormatError(path, "names its meshes so often that they are too large together")


def _glb_corners(data: bytes) -> int:
    """Return how many values and corners the meshes of a GLB file have, each as often as it is used."""
    if len(data) < _HEAD.size + _CHUNK.size or data[:4] != b"glTF":
        raise ValueError("no GLB file")
    length, kind = _CHUNK.unpack_from(data, _HEAD.size)
    start = _HEAD.size + _CHUNK.size
    if kind != b"JSON" or length > len(data) - start:
        raise ValueError("no JSON where it has to be")
    try:
        header = json.loads(data[start : start + length])
        counts = [_whole(accessor["count"]) for accessor in header.get("accessors", [])]
        views = sum(_whole(view["byteLength"]) for view in header.get("bufferViews", []))
        meshes = [
            sum(counts[_whole(index)] for part in mesh["primitives"] for index in _accessors(part))
            for mesh in header.get("meshes", [])
        ]
        used = _used_corners(header.get("nodes", []), meshes)
    except (AttributeError, IndexError, KeyError, RecursionError, TypeError):
        raise ValueError("a JSON header that is none of glTF") from None
    if views > 2 * len(data):
        raise ValueError("parts of its buffers stand for more than the file")
    return max(sum(counts), sum(meshes), used)


def _accessors(part: dict[str, Any]) -> Iterable[Any]:
    """Return the numbers of the accessors that a primitive reads."""
    return [*part["attributes"].values(), *([part["indices"]] if "indices" in part else [])]


def _used_corners(nodes: list[dict[str, Any]], meshes: list[int]) -> int:
    """Return the corners of all trees of nodes, nodes below several others each time."""
    known: dict[int, int] = {}

    def corners(number: int) -> int:
        if number not in known:
            node = nodes[number]
            own = meshes[_whole(node["mesh"])] if "mesh" in node else 0
            known[number] = own + sum(corners(_whole(child)) for child in node.get("children", []))
        return known[number]

    below = {child for node in nodes for child in node.get("children", [])}
    found = [corners(number) for number in range(len(nodes))]  # of all, so that no loop is overlooked
    return sum(count for number, count in enumerate(found) if number not in below)


def _whole(value: Any) -> int:
    """Return a whole number that is not negative."""
    if type(value) is not int or value < 0:
        raise TypeError(value)
    return value


def _dae_bytes(data: bytes) -> int:
    """Return how much text the geometries of a COLLADA file have, each as often as it is used."""
    if len(re.findall(rb"<instance_node\b", data)) > MAX_NESTED:
        raise ValueError(f"more than {MAX_NESTED} references to nodes")
    starts = [(found.start(), found[1]) for found in re.finditer(rb"<geometry\b[^>]*\bid\s*=\s*[\"']([^\"']*)", data)]
    ends = [*(place for place, _ in starts[1:]), len(data)]
    sizes = {name: end - place for (place, name), end in zip(starts, ends, strict=True)}
    names = re.findall(rb"<instance_geometry\b[^>]*\burl\s*=\s*[\"']#([^\"']*)", data)
    return sum(sizes.get(name, 0) for name in names)
