"""Random objects in size for a hand: closed forms, hulls of points and turned bodies."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ..files.writing import write_bytes
from ..spatial import Array
from .base import GraspObject
from .ellipsoid import EllipsoidObject
from .mesh_object import MeshObject
from .primitives import Box, Capsule, Cylinder, Sphere

if TYPE_CHECKING:
    import trimesh

MASS = 0.2
"""Mass of every object [kg]."""
HULL_POINTS, SECTIONS = 24, 48
"""Points that a hull is put around; sides of a turned body."""


def _cylinder(rng: np.random.Generator) -> GraspObject:
    return Cylinder(radius=float(rng.uniform(0.020, 0.045)), mass=MASS)


def _sphere(rng: np.random.Generator) -> GraspObject:
    return Sphere(radius=float(rng.uniform(0.025, 0.045)), mass=MASS)


def _box(rng: np.random.Generator) -> GraspObject:
    x, y, z = (float(edge) for edge in rng.uniform(0.040, 0.080, 3))
    return Box(x=x, y=y, z=z, mass=MASS, edge=0.005)


def _capsule(rng: np.random.Generator) -> GraspObject:
    return Capsule(radius=float(rng.uniform(0.020, 0.040)), height=float(rng.uniform(0.04, 0.10)), mass=MASS)


def _ellipsoid(rng: np.random.Generator) -> GraspObject:
    x, y, z = (float(half) for half in rng.uniform(0.025, 0.045, 3))
    return EllipsoidObject(x=x, y=y, z=z, mass=MASS)


CLOSED_FORMS: Mapping[str, Callable[[np.random.Generator], GraspObject]] = MappingProxyType(
    {"cylinder": _cylinder, "sphere": _sphere, "box": _box, "capsule": _capsule, "ellipsoid": _ellipsoid}
)
"""Random objects by kind: cylinders of 20–45 mm radius, spheres of 25–45 mm, boxes of 40–80 mm rounded by 5 mm,
capsules of 20–40 mm radius, ellipsoids of 25–45 mm half axes."""


def _hull(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return the hull of random points on an ellipsoid with half axes of 25 to 45 mm."""
    import trimesh

    points = rng.normal(size=(HULL_POINTS, 3))
    points *= rng.uniform(0.025, 0.045, 3) / np.linalg.norm(points, axis=1, keepdims=True)
    return trimesh.convex.convex_hull(points)


def _turned(rng: np.random.Generator) -> trimesh.Trimesh:
    """Return a body of revolution 80 to 140 mm high: radii of 20 to 45 mm, with waists and bellies between them."""
    import trimesh

    heights = np.linspace(0.0, float(rng.uniform(0.08, 0.14)), 5)
    radii: Array = rng.uniform(0.020, 0.045, 5)
    fine = np.linspace(0.0, heights[-1], 24)
    # Cosines between the given radii: no edge but those of the two ends.
    share = np.searchsorted(heights, fine, side="right").clip(1, 4) - 1
    along = 0.5 - 0.5 * np.cos(np.pi * (fine - heights[share]) / np.diff(heights)[share])
    profile = np.column_stack([radii[share] + along * np.diff(radii)[share], fine])
    closed = np.vstack([[0.0, 0.0], profile, [0.0, heights[-1]]])
    mesh = trimesh.creation.revolve(closed, sections=SECTIONS)
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


MESHES: Mapping[str, Callable[[np.random.Generator], trimesh.Trimesh]] = MappingProxyType(
    {"hull": _hull, "turned": _turned}
)
"""Random solids of triangles by kind, convex and not."""


def random_object(kind: str, rng: np.random.Generator, folder: Path) -> GraspObject:
    """Return a random object.

    Args:
        kind: One of :data:`CLOSED_FORMS` or of :data:`MESHES`.
        rng: Source of random numbers.
        folder: Where the file of a mesh is written, named by its content.

    Returns:
        The object, of 0.2 kg.
    """
    if kind in CLOSED_FORMS:
        return CLOSED_FORMS[kind](rng)
    mesh = MESHES[kind](rng)
    path = folder / f"{kind}_{hashlib.sha256(mesh.vertices.tobytes()).hexdigest()[:16]}.ply"
    if not path.is_file():
        write_bytes(path, mesh.export(file_type="ply"))
    return MeshObject.load(path, mass=MASS)
