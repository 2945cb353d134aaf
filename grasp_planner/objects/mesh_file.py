"""Reading meshes strictly: size caps first, then one clear line for everything that is no solid.

Files are parsed from memory without resolving what they refer to (materials, textures, other files).
"""

from __future__ import annotations

import contextlib
import io
import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import FileFormatError, shown
from ..files.quiet import quiet
from ..files.reading import MESH_SUFFIXES, opened_file, read_bounded
from ..files.scenes import check_scene
from ..files.text import refuse_entities
from .holes import thickened
from .mending import Solid, mended

if TYPE_CHECKING:
    import trimesh

MAX_MESH_BYTES = 200_000_000
"""Largest mesh file that is read."""
MAX_FACES = 2_000_000
"""Most triangles of a mesh."""
_UNIT = re.compile(rb"<unit\b[^>]*\bmeter\s*=\s*[\"']([0-9.eE+-]{1,30})[\"']")
_NO_NUMBER = re.compile(rb"^\s*(?:v|vertex)?\s[^#]*?(?<=\s)([+-]?(?:nan|inf|infinity))(?=\s|$)", re.IGNORECASE)
_WORD = re.compile(rb"(\S+)")
_HEAD_BYTES = 100_000
MAX_COORDINATE = 1e12
"""Largest coordinate, in the unit of the file."""


class MeshWarning(UserWarning):
    """Something about a mesh that should be seen: likely wrong units, or what a repair has done."""


def read_solid(path: Path, *, repair: bool = False, shell: float = 0.0) -> Solid:
    """Read a mesh and make of it the solid that it bounds.

    Args:
        path: STL, OBJ, PLY, GLB or DAE file.
        repair: Whether to close holes of every size; small ones are closed anyway.
        shell: Thickness given to the surface first, in the unit of the file; 0 for none.

    Returns:
        The solid.

    Raises:
        FileFormatError: If it can't be read, is too large, or is no solid; the reason names the defect.
    """
    mesh = _read(path)
    if not shell:
        return mended(path, mesh, fill=repair)
    solid = mended(path, thickened(mesh, shell), fill=repair)
    return replace(solid, repairs=("walls were given their thickness, half on each side", *solid.repairs))


def declared_unit(path: Path) -> float:
    """Return the length of a file's unit [m] where it declares one, as COLLADA may; 1 otherwise.

    A file that can't be read has none.
    """
    if path.suffix.lower() != ".dae":
        return 1.0
    with contextlib.suppress(FileFormatError, OSError, ValueError), opened_file(path, MAX_MESH_BYTES) as file:
        found = _UNIT.search(file.read(_HEAD_BYTES))  # the schema has it before everything else
        if found and 1e-9 <= (unit := float(found[1])) <= 1e9:
            return unit
    return 1.0


def _read(path: Path) -> trimesh.Trimesh:
    """Return the triangles of a file with duplicate vertices merged, after the caps."""
    import trimesh

    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise FileFormatError(path, f"suffix {shown(suffix)} is none of {', '.join(MESH_SUFFIXES)}")
    data = read_bounded(path, MAX_MESH_BYTES)
    if not data:
        raise FileFormatError(path, "is empty")
    if suffix == ".dae":
        try:
            refuse_entities(path, data.decode("utf-8"))
        except UnicodeDecodeError:
            raise FileFormatError(path, "is not UTF-8 text") from None
    check_scene(path, data)
    try:
        with warnings.catch_warnings(), quiet("trimesh"):
            warnings.simplefilter("ignore")
            options = {"skip_materials": True} if suffix in (".obj", ".glb") else {}
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=suffix[1:], process=False, **options)
            if isinstance(mesh, trimesh.Scene):
                mesh = _one_mesh(mesh)
    except Exception as error:
        reason = _no_number(data) or (str(error) or type(error).__name__).splitlines()[0][:80]
        raise FileFormatError(path, f"is not a valid {suffix[1:].upper()} mesh: {reason}") from None
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise FileFormatError(path, "contains no triangles")
    if len(mesh.faces) > MAX_FACES:
        raise FileFormatError(path, f"{len(mesh.faces)} triangles, more than the {MAX_FACES} allowed")
    return _cleaned(path, mesh, data)


def _one_mesh(scene: trimesh.Scene) -> trimesh.Trimesh:
    """Return a scene as one mesh.

    Raises:
        ValueError: If its meshes are used so often that there would be too many triangles.
    """
    names = [scene.graph[node][1] for node in scene.graph.nodes_geometry]
    faces = sum(len(getattr(scene.geometry[name], "faces", ())) for name in names)
    if faces > MAX_FACES:
        raise ValueError(f"{faces} triangles, more than the {MAX_FACES} allowed")
    return scene.to_mesh()


def _no_number(data: bytes) -> str:
    """Say which line of a text file gives a vertex a coordinate that is no finite number; nothing if none does."""
    if b"\0" in data[:1000]:
        return ""
    for number, line in enumerate(data.splitlines(), 1):
        found = _NO_NUMBER.search(line) or _no_float(line)
        if found:
            return f"line {number} says {shown(found[1].decode('utf-8', 'replace'))}"
    return ""


def _no_float(line: bytes) -> re.Match[bytes] | None:
    """Return the first coordinate of a vertex of an OBJ or STL file that can't be read; None if all can."""
    if not line.lstrip().startswith((b"v ", b"vertex ")):
        return None
    for found in list(_WORD.finditer(line))[1:4]:
        try:
            float(found[1])
        except ValueError:
            return found
    return None


def _cleaned(path: Path, mesh: trimesh.Trimesh, data: bytes) -> trimesh.Trimesh:
    """Return a bare mesh with finite, merged vertices and no triangle that is only a line."""
    import trimesh

    try:
        vertices, faces = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64)
    except (OverflowError, TypeError, ValueError):
        raise FileFormatError(path, "has triangles or vertices that are no numbers") from None
    if vertices.ndim != 2 or vertices.shape[1:] != (3,) or faces.shape[1:] != (3,):
        raise FileFormatError(path, "has vertices without three coordinates")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise FileFormatError(path, f"a triangle names a vertex that is none of its {len(vertices)}")
    if not np.isfinite(vertices[faces]).all():
        place = _no_number(data)
        raise FileFormatError(path, f"has vertices that are not finite numbers{': ' if place else ''}{place}")
    if np.abs(vertices[faces]).max() > MAX_COORDINATE:
        raise FileFormatError(path, f"has coordinates larger than {MAX_COORDINATE:g}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bare = trimesh.Trimesh(vertices=vertices, faces=faces, process=False)
        bare.merge_vertices(merge_tex=True, merge_norm=True)
        first, second, third = bare.faces.T
        bare.update_faces((first != second) & (second != third) & (third != first))
        bare.remove_unreferenced_vertices()
    if len(bare.faces) == 0 or not bare.extents.max() > 0.0:
        raise FileFormatError(path, "contains no triangles with an area")
    return bare
