"""Volume, centre of mass and inertia of the solid that triangles bound."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..spatial import Array, readonly
from .triangles import Triangles

if TYPE_CHECKING:
    import trimesh

CELLS = 100
"""Cells along the longest side where the solid is counted out."""


def solid_moments(mesh: trimesh.Trimesh, *, overlapping: bool = False) -> tuple[float, Array, Array]:
    """Return volume, centre of mass and inertia about it per mass, of uniform density.

    Args:
        mesh: The surface, normals outward [m].
        overlapping: Whether triangles lie inside; then cells are counted (error below a cell), otherwise the integrals
            are exact.

    Returns:
        Volume [m³], centre [m] of shape (3,), and inertia over mass [m²], of shape (3, 3).
    """
    if not overlapping:
        volume = float(mesh.volume)
        return volume, readonly(mesh.center_mass), readonly(np.asarray(mesh.moment_inertia) / volume)
    low, cell = np.asarray(mesh.bounds[0]), float(mesh.extents.max()) / CELLS
    lines = [low[k] + cell * (np.arange(np.ceil(mesh.extents[k] / cell)) + 0.5) for k in range(3)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[Triangles.of(mesh).winding_number(points) > 0.5]
    centre = points.mean(axis=0)
    arms = points - centre
    spread = arms.T @ arms / len(arms) + cell**2 / 12 * np.eye(3)
    return len(points) * cell**3, readonly(centre), readonly(np.trace(spread) * np.eye(3) - spread)


def parts_moments(parts: list[trimesh.Trimesh], densities: tuple[float, ...]) -> tuple[float, Array, Array]:
    """Return mass, centre of mass and inertia about it per mass of parts that have densities of their own.

    Args:
        parts: Their surfaces, normals outward [m]; where they overlap, the first counts.
        densities: Density of each [kg/m³].

    Returns:
        Mass [kg], centre [m] of shape (3,), and inertia over mass [m²], of shape (3, 3).

    Raises:
        ValueError: If parts can't be told apart where they overlap.
    """
    import trimesh

    masses, centres, inertias = [], [], []
    for k, (part, density) in enumerate(zip(parts, densities, strict=True)):
        low, high = part.bounds
        near = [other for other in parts[:k] if ((other.bounds[0] < high) & (other.bounds[1] > low)).all()]
        rest = trimesh.boolean.difference([part, *near], engine="manifold") if near else part
        if not rest.volume > 0.0:  # all of it is within earlier ones
            continue
        masses.append(density * float(rest.volume))
        centres.append(np.asarray(rest.center_mass))
        inertias.append(density * np.asarray(rest.moment_inertia))
    mass = sum(masses)
    centre = np.average(centres, axis=0, weights=masses)
    about = np.zeros((3, 3))
    for each, place, inertia in zip(masses, centres, inertias, strict=True):
        arm = place - centre
        about += inertia + each * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, readonly(centre), readonly(about / mass)
