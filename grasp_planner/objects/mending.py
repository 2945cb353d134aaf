"""Triangles made a solid, whatever their topology: what the winding number says is inside.

A surface winds a whole number of times around every point if each of its directed edges is walked as often back as
forth. So vertices are welded, triangles turned, small holes closed until that holds; overlapping parts are united.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import FileFormatError
from ..spatial import Indices
from .holes import filled, open_edges
from .sides import OVERLAP_ALLOWED, Sides, probed_sides
from .triangles import Triangles

if TYPE_CHECKING:
    import trimesh

WELD = 1e-5
"""Vertices nearer than this share of the longest side are one."""
MAX_PARTS = 2000
"""Most parts that are united."""


@dataclass(frozen=True)
class Solid:
    """The surface of a solid, normals outward.

    Attributes:
        mesh: The triangles, in the frame and unit of the file.
        repairs: What was done to them, one line each; empty if nothing was.
        overlapping: Whether some of them lie inside, so that integrals over the surface count twice.
        parted: The triangles before parts were united; None if they were not.
    """

    mesh: trimesh.Trimesh
    repairs: tuple[str, ...] = ()
    overlapping: bool = False
    parted: trimesh.Trimesh | None = None

    @property
    def parts(self) -> list[trimesh.Trimesh]:
        """Its parts, also those that were united, in the order of the file; cavities are parts with normals inward."""
        mesh = self.mesh if self.parted is None else self.parted
        groups = sorted(_parts(mesh), key=lambda group: int(group.min()))
        return [mesh.submesh([np.sort(group)], append=True) for group in groups]


def mended(path: Path, mesh: trimesh.Trimesh, *, fill: bool = False) -> Solid:
    """Return the solid that triangles bound.

    Args:
        path: The file, for messages.
        mesh: Its triangles.
        fill: Whether to close holes of every size.

    Returns:
        The solid.

    Raises:
        FileFormatError: If they bound no solid; the reason says how far the winding number is from 0 and 1, and where.
    """
    done: list[str] = []
    mesh = _distinct(mesh, done)
    if not mesh.is_watertight:
        mesh = _welded(mesh, done)
    if not mesh.is_winding_consistent:
        mesh = _turned(mesh, done)
    if len(open_edges(mesh)):
        mesh = filled(mesh, done, everything=fill)
    check_volume(path, mesh)
    if signed_volume(mesh) < 0.0:
        mesh.invert()
        done.append("turned the surface, which was inside out")
    sides = probed_sides(mesh)
    if sides.negative > OVERLAP_ALLOWED:
        mesh, sides = _parts_turned(mesh, sides, done)
    if not sides.defined:
        raise FileFormatError(path, _no_solid(mesh, sides))
    overlapping, parted = False, None
    if not sides.sound:
        united = _united(mesh)
        overlapping = united is None and sides.doubled > OVERLAP_ALLOWED
        if united is None:
            done.append(f"took as one what overlaps or folds over itself ({sides.folded:.1%} of the surface)")
        else:
            mesh, parted = united, mesh
            done.append("united parts that overlapped or touched")
    if (count := _bodies(mesh)) > 1:
        done.append(f"holds {count} separate parts, taken as one rigid object")
    return Solid(mesh, tuple(done), overlapping, parted)


def signed_volume(mesh: trimesh.Trimesh) -> float:
    """Return the volume by the divergence theorem, negative if normals point inwards."""
    return float(np.linalg.det(np.asarray(mesh.triangles) - mesh.bounds.mean(axis=0)).sum()) / 6.0


def check_volume(path: Path, mesh: trimesh.Trimesh) -> None:
    """Check that there is something inside."""
    extent, volume = float(mesh.extents.max()), signed_volume(mesh)
    if abs(volume) < 1e-9 * extent**3:
        raise FileFormatError(path, f"encloses no volume ({volume:.3g} for a size of {extent:.3g})")


def _no_solid(mesh: trimesh.Trimesh, sides: Sides) -> str:
    """Say why triangles bound no solid, and what would help."""
    holes = len(open_edges(mesh))
    what = f"is not watertight ({holes} open edges)" if holes else "is no solid"
    if sides.unclear <= OVERLAP_ALLOWED:
        return f"{what}: its surface winds backwards around {sides.negative:.1%} of what it encloses"
    place = ", ".join(f"{x:.3g}" for x in sides.place)
    where = f"{sides.unclear:.1%} of the surface, most ({sides.farthest:.2f}) at ({place})"
    return f"{what}: winding number not near 0 or 1 at {where}{'; try repair=1 or shell=0.002' if holes else ''}"


def _distinct(mesh: trimesh.Trimesh, done: list[str]) -> trimesh.Trimesh:
    """Return the mesh without triangles that are there twice, or once each way, as between parts that touch."""
    import igl
    import trimesh

    faces = np.asarray(mesh.faces, dtype=np.int64)
    turns = faces[np.arange(len(faces))[:, None], (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3]
    once = np.unique(turns, axis=0)
    kept = np.asarray(igl.resolve_duplicated_faces(once)[0])
    if len(kept) == len(faces) or not len(kept):
        return mesh
    done.append(f"left out {len(faces) - len(kept)} triangles that were there twice, or between parts")
    found = trimesh.Trimesh(vertices=mesh.vertices, faces=kept, process=False)
    found.remove_unreferenced_vertices()
    return found


def _welded(mesh: trimesh.Trimesh, done: list[str]) -> trimesh.Trimesh:
    """Return the mesh with vertices that nearly coincide made one."""
    import trimesh
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    vertices = np.asarray(mesh.vertices)
    pairs = cKDTree(vertices).query_pairs(WELD * float(mesh.extents.max()), output_type="ndarray")
    if len(pairs) == 0:
        return mesh
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(vertices),) * 2)
    labels = connected_components(links, directed=False)[1]
    first = np.unique(labels, return_index=True)[1]
    faces = labels[np.asarray(mesh.faces)]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    if len(faces) == 0:
        return mesh
    done.append(f"welded {len(vertices) - len(first)} vertices that nearly coincided")
    welded = trimesh.Trimesh(vertices=vertices[first], faces=faces, process=False)
    welded.remove_unreferenced_vertices()
    return _distinct(welded, done)


def _turned(mesh: trimesh.Trimesh, done: list[str]) -> trimesh.Trimesh:
    """Return the mesh with the triangles of every patch turned as most of it is."""
    import igl
    import trimesh

    before = np.asarray(mesh.faces, dtype=np.int64)
    faces, patches = (np.array(part) for part in igl.bfs_orient(before))
    area = np.asarray(mesh.area_faces)
    against = ~np.any([(np.roll(faces, turn, axis=1) == before).all(axis=1) for turn in range(3)], axis=0)
    lost = np.bincount(patches, weights=np.where(against, area, -area)) > 0.0
    faces[lost[patches]] = faces[lost[patches], ::-1]
    count = int((against ^ lost[patches]).sum())
    if not count:
        return mesh
    done.append(f"turned {count} flipped triangle{'s' if count > 1 else ''}")
    return trimesh.Trimesh(vertices=mesh.vertices, faces=faces, process=False)


def _parts(mesh: trimesh.Trimesh) -> list[Indices]:
    """Return the triangles of each part that hangs together over edges that join two triangles."""
    import trimesh

    groups = trimesh.graph.connected_components(mesh.face_adjacency, nodes=np.arange(len(mesh.faces)))
    return [np.asarray(group) for group in groups]


def _bodies(mesh: trimesh.Trimesh) -> int:
    """Return how many parts there are that are not cavities."""
    parts = _parts(mesh)
    if len(parts) < 2:
        return 1
    label = np.empty(len(mesh.faces), dtype=int)
    for number, part in enumerate(parts):
        label[part] = number
    volumes = np.linalg.det(np.asarray(mesh.triangles) - mesh.bounds.mean(axis=0))
    return int((np.bincount(label, weights=volumes) > 1e-9 * float(mesh.extents.max()) ** 3).sum())


def _parts_turned(mesh: trimesh.Trimesh, sides: Sides, done: list[str]) -> tuple[trimesh.Trimesh, Sides]:
    """Return the mesh with parts that are inside out, and are no cavities, turned."""
    import trimesh

    faces, count = np.array(mesh.faces), 0
    parts = _parts(mesh)
    corners = np.asarray(mesh.triangles)
    for part in parts if len(parts) <= MAX_PARTS else ():
        if np.linalg.det(corners[part] - corners[part].mean(axis=(0, 1))).sum() >= 0.0:
            continue
        rest = trimesh.Trimesh(mesh.vertices, np.delete(faces, part, axis=0), process=False)
        if len(rest.faces) and Triangles.of(rest).winding_number(corners[part[:1], 0])[0] > 0.5:
            continue
        faces[part] = faces[part][:, ::-1]
        count += 1
    if not count:
        return mesh, sides
    done.append(f"turned {count} parts that were inside out")
    turned = trimesh.Trimesh(mesh.vertices, faces, process=False)
    return turned, probed_sides(turned)


def _united(mesh: trimesh.Trimesh) -> trimesh.Trimesh | None:
    """Return the mesh without what lies inside: the union of its parts, or its triangles that lie outside.

    None if neither gives a solid.
    """
    import trimesh

    groups = _parts(mesh)
    parts = [mesh.submesh([group], append=True) for group in groups] if 1 < len(groups) <= MAX_PARTS else []
    union = None
    if parts and all(part.is_watertight for part in parts):
        with contextlib.suppress(Exception):  # manifold3d has many of its own
            union = trimesh.boolean.union(parts, engine="manifold", check_volume=False)
    if union is not None and len(union.faces) and probed_sides(union).sound:
        return union
    step = 0.05 * np.sqrt(np.asarray(mesh.area_faces))[:, None] * np.asarray(mesh.face_normals)
    outer = mesh.copy()
    outer.update_faces(Triangles.of(mesh).winding_number(np.asarray(mesh.triangles_center) + step) < 0.5)
    outer.remove_unreferenced_vertices()
    return outer if len(outer.faces) and not len(open_edges(outer)) and probed_sides(outer).sound else None
