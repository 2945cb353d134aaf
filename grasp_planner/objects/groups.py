"""Named parts of mesh files: groups, objects and materials of OBJ, nodes and meshes of GLB, geometries of COLLADA."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np

from ..exceptions import FileFormatError
from ..files.quiet import quiet
from ..files.reading import read_bounded
from ..files.scenes import check_scene
from ..spatial import Array
from .mesh_file import MAX_MESH_BYTES

MOST_NAMES = 1000
"""Most names that a file is looked through for."""


def named_boxes(path: Path) -> dict[str, Array]:
    """Return the box around every named part of a file, lower and upper corner in its unit, of shape (2, 3).

    Args:
        path: OBJ, GLB or DAE file; others name no parts.

    Raises:
        FileFormatError: If it can't be read, or has too many names.
    """
    suffix = path.suffix.lower()
    if suffix not in (".obj", ".glb", ".dae"):
        return {}
    data = read_bounded(path, MAX_MESH_BYTES)
    try:
        clouds = _obj_parts(data) if suffix == ".obj" else _scene_parts(path, data)
    except FileFormatError:
        raise
    except Exception:  # libraries have many of their own
        raise FileFormatError(path, "has no parts that can be told apart by name") from None
    if len(clouds) > MOST_NAMES:
        raise FileFormatError(path, f"has {len(clouds)} named parts, more than the {MOST_NAMES} allowed")
    return {
        name: np.array([points.min(axis=0), points.max(axis=0)])
        for name, points in clouds.items()
        if len(points) and np.isfinite(points).all()
    }


def _obj_parts(data: bytes) -> dict[str, Array]:
    """Return the corners of the faces under each name of an OBJ file, by its lines g, o and usemtl."""
    vertices: list[list[float]] = []
    current: dict[str, str] = {}
    used: dict[str, set[int]] = {}
    for line in data.decode("utf-8", "replace").splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(each) for each in rest[:3]])
        elif word in ("g", "o", "usemtl"):
            current[word] = " ".join(rest)
        elif word == "f":
            corners = [int(each.split("/")[0]) for each in rest]
            indices = {corner - 1 if corner > 0 else len(vertices) + corner for corner in corners}
            for name in current.values():
                used.setdefault(name, set()).update(indices)
    points = np.array(vertices)
    return {name: points[sorted(indices)] for name, indices in used.items() if name}


def _scene_parts(path: Path, data: bytes) -> dict[str, Array]:
    """Return the vertices under each node and mesh of a GLB or COLLADA file."""
    import trimesh

    check_scene(path, data)
    with warnings.catch_warnings(), quiet("trimesh"):
        warnings.simplefilter("ignore")
        scene = trimesh.load_scene(io.BytesIO(data), file_type=path.suffix[1:].lower())
    clouds: dict[str, list[Array]] = {}
    for node in scene.graph.nodes_geometry:
        pose, mesh = scene.graph[node]
        points = trimesh.transform_points(scene.geometry[mesh].vertices, pose)
        for name in {node, mesh}:
            clouds.setdefault(name, []).append(points)
    return {name: np.vstack(parts) for name, parts in clouds.items()}
