"""Reading meshes strictly: size caps first, then one clear line for everything that is no solid.

Files are parsed from memory without resolving what they refer to (materials, textures, other files).
"""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import FileFormatError
from ..files.reading import read_bounded
from ..files.text import refuse_entities
from ..spatial import Indices
from .triangles import winding_number

if TYPE_CHECKING:
    import trimesh

MAX_MESH_BYTES = 200_000_000
"""Largest mesh file that is read."""
MAX_FACES = 2_000_000
"""Most triangles of a mesh."""
MESH_SUFFIXES = (".stl", ".obj", ".ply", ".glb", ".dae")
"""Formats that are read, by file suffix."""
MAX_COORDINATE = 1e12
"""Largest coordinate, in the unit of the file."""
PROBED_FACES = 20_000
"""Most triangles at which inside and outside are compared."""


class MeshWarning(UserWarning):
    """Something about a mesh that should be seen: likely wrong units, or what a repair has done."""


@dataclass(frozen=True)
class Solid:
    """A watertight mesh with outward normals.

    Attributes:
        mesh: The mesh, in the frame and unit of the file.
        repairs: What was repaired, one sentence each; empty if nothing was.
    """

    mesh: trimesh.Trimesh
    repairs: tuple[str, ...] = ()


def read_solid(path: Path, *, repair: bool = False) -> Solid:
    """Read a mesh and check that it bounds a solid.

    Args:
        path: STL, OBJ, PLY, GLB or DAE file.
        repair: Whether to repair holes, flipped triangles and overlapping parts instead of refusing them.

    Returns:
        The solid.

    Raises:
        FileFormatError: If it can't be read, is too large, or is no solid; the reason names the defect.
    """
    mesh = _read(path)
    repairs: list[str] = []
    if not mesh.is_watertight:
        if not repair:
            raise FileFormatError(path, f"{_edge_defects(mesh)}{_HINT}")
        _fill(path, mesh, repairs)
    if not mesh.is_winding_consistent:
        if not repair:
            raise FileFormatError(path, f"has triangles with flipped normals{_HINT}")
        mesh.fix_normals(multibody=True)
        repairs.append("turned flipped triangles")
    extent = float(mesh.extents.max())
    volume = float(np.linalg.det(mesh.triangles).sum()) / 6.0
    if abs(volume) < 1e-9 * extent**3:
        raise FileFormatError(path, f"encloses no volume ({volume:.3g} for a size of {extent:.3g})")
    if volume < 0.0:
        if not repair:
            raise FileFormatError(path, f"is inside out: its normals point inwards{_HINT}")
        mesh.invert()
        repairs.append("turned the surface inside out")
    share = _overlap(mesh)
    if share > OVERLAP_ALLOWED:
        if not repair:
            raise FileFormatError(path, f"intersects itself over {share:.1%} of its surface{_HINT}")
        mesh = _united(path, mesh)
        repairs.append(f"united parts that overlapped over {share:.1%} of the surface")
    return Solid(mesh, tuple(repairs))


_HINT = "; repair=1 tries to mend it"
OVERLAP_ALLOWED = 1e-3
"""Share of the surface that may lie inside the mesh itself (round-off at sharp creases)."""


def _read(path: Path) -> trimesh.Trimesh:
    """Return the triangles of a file with duplicate vertices merged, after the caps."""
    import trimesh

    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise FileFormatError(path, f"suffix {suffix!r} is none of {', '.join(MESH_SUFFIXES)}")
    data = read_bounded(path, MAX_MESH_BYTES)
    if not data:
        raise FileFormatError(path, "is empty")
    if suffix == ".dae":
        try:
            refuse_entities(path, data.decode("utf-8"))
        except UnicodeDecodeError:
            raise FileFormatError(path, "is not UTF-8 text") from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            options = {"skip_materials": True} if suffix == ".obj" else {}
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=suffix[1:], process=False, **options)
            if isinstance(mesh, trimesh.Scene):
                mesh = mesh.to_mesh()
    except Exception as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise FileFormatError(path, f"is not a valid {suffix[1:].upper()} mesh: {reason}") from None
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise FileFormatError(path, "contains no triangles")
    if len(mesh.faces) > MAX_FACES:
        raise FileFormatError(path, f"{len(mesh.faces)} triangles, more than the {MAX_FACES} allowed")
    return _cleaned(path, mesh)


def _cleaned(path: Path, mesh: trimesh.Trimesh) -> trimesh.Trimesh:
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
        raise FileFormatError(path, "has vertices that are not finite numbers")
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


def _edge_defects(mesh: trimesh.Trimesh) -> str:
    """Say how many edges do not join exactly two triangles."""
    counts = _triangles_of_edges(mesh)
    single, many = int((counts == 1).sum()), int((counts > 2).sum())
    parts = [f"is not watertight: {single} open edges"] if single else []
    parts += [f"is not manifold: {many} edges join more than two triangles"] if many else []
    return " and ".join(parts) or "is not watertight"


def _open_edges(mesh: trimesh.Trimesh) -> int:
    """Return the number of edges that do not join exactly two triangles."""
    return int((_triangles_of_edges(mesh) != 2).sum())


def _triangles_of_edges(mesh: trimesh.Trimesh) -> Indices:
    """Return how many triangles each edge belongs to, of shape (n_edges,)."""
    counts: Indices = np.unique(mesh.edges_sorted, axis=0, return_counts=True)[1]
    return counts


def _fill(path: Path, mesh: trimesh.Trimesh, repairs: list[str]) -> None:
    """Close holes in place, or say that it can't be done."""
    holes, before = _open_edges(mesh), len(mesh.faces)
    mesh.update_faces(mesh.unique_faces())
    mesh.fix_normals()
    mesh.fill_holes()
    if not mesh.is_watertight:
        raise FileFormatError(path, f"is not watertight and could not be repaired: {_open_edges(mesh)} edges left")
    repairs.append(f"closed {holes} open edges, {len(mesh.faces) - before:+d} triangles")


def _overlap(mesh: trimesh.Trimesh) -> float:
    """Return the share of the surface with the wrong side in or out, by generalized winding numbers.

    Just below the surface of a solid the winding number is 1, just above it 0; a part of the surface that lies
    inside the mesh has other values (Barill et al., Fast winding numbers for soups and clouds, 2018).
    """
    pick = slice(None, None, 1 + len(mesh.faces) // PROBED_FACES)
    centres, normals = mesh.triangles_center[pick], mesh.face_normals[pick]
    area = mesh.area_faces[pick]
    # No farther off than a fraction of the triangle itself: neighbours at sharp creases are not reached.
    step = np.minimum(1e-4 * mesh.extents.max(), 0.05 * np.sqrt(area))[:, None]
    inside = winding_number(mesh, centres - step * normals)
    outside = winding_number(mesh, centres + step * normals)
    wrong = (np.abs(inside - 1.0) > 0.5) | (np.abs(outside) > 0.5)
    return float(area[wrong].sum() / max(float(area.sum()), 1e-300))


def _united(path: Path, mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the union of the parts of a mesh."""
    import trimesh

    parts = [part for part in mesh.split(only_watertight=True) if part.volume > 0.0]
    if len(parts) < 2:
        raise FileFormatError(path, "a single part intersects itself, which can't be repaired")
    try:
        union = trimesh.boolean.union(parts, engine="manifold")
    except Exception as error:
        raise FileFormatError(path, f"its overlapping parts can't be united: {error}") from None
    if not (union.is_watertight and union.volume > 0.0 and _overlap(union) <= OVERLAP_ALLOWED):
        raise FileFormatError(path, "its overlapping parts can't be united into a solid")
    return union
