"""Meshes drawn besides hand and object: friction cones, and ellipsoids cut open where they are unbounded."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import trimesh

from ..model.task import Ellipsoid
from ..spatial import Array
from ..values import number_text

Mask = npt.NDArray[np.bool_]
Faces = npt.NDArray[np.intp]

HALF_LENGTH = 0.06
"""Half length at which the longest axis of an ellipsoid is drawn, or where it is cut [m]."""
FLATTEST = 25.0
"""Largest ratio of the longest to the shortest axis at which an ellipsoid is drawn whole, however flat."""
LONGEST_RATIO = 4.0
"""Axes of flatter ones that are longer than this multiple of the shortest are cut there."""
RINGS, SECTORS = 36, 48


@dataclass(frozen=True)
class EllipsoidShape:
    """A drawable ellipsoid.

    Attributes:
        vertices: Around the centre [m], of shape (n, 3).
        faces: Triangles, of shape (m, 3).
        cut_axes: Unit directions in which the surface is cut off, of shape (k, 3).
        note: What the shape is, in words.
    """

    vertices: Array
    faces: Faces
    cut_axes: Array
    note: str


def ellipsoid_shape(ellipsoid: Ellipsoid) -> EllipsoidShape:
    """Return the honest picture of an ellipsoid: open where an axis goes on beyond the picture.

    One long axis gives an open tube, two give a pair of facing plates, three nothing at all.

    Args:
        ellipsoid: The ellipsoid; lengths longest first, infinite where it is degenerate.

    Returns:
        The mesh and what it means.
    """
    lengths = np.asarray(ellipsoid.lengths)
    finite = lengths[np.isfinite(lengths)]
    if not finite.size:
        return EllipsoidShape(
            np.zeros((0, 3)), np.zeros((0, 3), dtype=int), ellipsoid.axes.T, "unbounded in every direction"
        )
    shortest = float(finite.min())
    cut = (lengths > LONGEST_RATIO * shortest) & (lengths.max() > FLATTEST * shortest)
    # Relative half lengths in which the picture ends at HALF_LENGTH.
    relative = lengths / (LONGEST_RATIO * shortest if cut.any() else lengths.max())
    vertices, faces = _radial_grid(relative, cut)
    return EllipsoidShape(vertices * HALF_LENGTH @ ellipsoid.axes.T, faces, ellipsoid.axes.T[cut], _note(lengths, cut))


def cone_mesh(friction: float, length: float) -> tuple[Array, Faces]:
    """Return vertices [m] and faces of a friction cone: tip at the origin, opening along +z.

    Args:
        friction: Coefficient of friction μ, the tangent of its half angle.
        length: Height of the cone [m].
    """
    cone = trimesh.creation.cone(radius=max(min(friction, 3.0), 0.01) * length, height=length, sections=32)
    vertices = np.array(cone.vertices)
    vertices[:, 2] = length - vertices[:, 2]
    return vertices, np.array(cone.faces)[:, ::-1]


def _radial_grid(lengths: Array, cut: Mask) -> tuple[Array, Faces]:
    """Return a grid on the surface with lengths relative to the picture, without what lies beyond it."""
    # The pole of the grid lies on the axis that keeps the cut edge a ring: the long one of one, else the short one.
    pole = 0 if cut.sum() <= 1 else 2
    others = [axis for axis in range(3) if axis != pole]
    if np.linalg.det(np.eye(3)[[*others, pole]]) < 0.0:
        others.reverse()
    polar = _polar_angles(lengths, cut, pole, others)
    around = np.linspace(0.0, 2.0 * np.pi, SECTORS, endpoint=False)
    directions = np.zeros((len(polar), SECTORS, 3))
    directions[:, :, others[0]] = np.sin(polar)[:, None] * np.cos(around)
    directions[:, :, others[1]] = np.sin(polar)[:, None] * np.sin(around)
    directions[:, :, pole] = np.cos(polar)[:, None]
    if not cut.any():
        # Stretched from a sphere: rays would leave the tips of a flat one without points.
        return (directions * lengths).reshape(-1, 3), _grid_faces(len(polar), open_middle=False)
    inverse_square = np.where(np.isfinite(lengths), 1.0 / np.square(lengths), 0.0)
    radius = 1.0 / np.sqrt(np.maximum((directions**2) @ inverse_square, 1e-12))
    vertices = (directions * radius[:, :, None]).reshape(-1, 3)
    return vertices, _grid_faces(len(polar), open_middle=bool(cut.sum() >= 2))


@lru_cache
def _grid_faces(rings: int, *, open_middle: bool) -> Faces:
    """Return the triangles of a grid of rings, without those between the two halves if they are apart."""
    ring, sector = np.meshgrid(np.arange(rings - 1), np.arange(SECTORS), indexing="ij")
    keep = ring != rings // 2 - 1 if open_middle else np.ones_like(ring, dtype=bool)
    ring, sector = ring[keep], sector[keep]
    a, b = ring * SECTORS + sector, ring * SECTORS + (sector + 1) % SECTORS
    faces = np.concatenate([np.stack([a, a + SECTORS, b], axis=1), np.stack([b, a + SECTORS, b + SECTORS], axis=1)])
    faces.setflags(write=False)
    return faces


def _polar_angles(lengths: Array, cut: Mask, pole: int, others: list[int]) -> Array:
    """Return the polar angles of the rings that lie inside the picture."""
    if not cut.any():
        return np.linspace(0.0, np.pi, RINGS)
    inverse = np.where(np.isfinite(lengths), 1.0 / lengths, 0.0)
    across = float(np.mean(inverse[others]))
    # Where the surface leaves the sphere of radius 1: cos² along² + sin² across² = 1.
    along = float(inverse[pole])
    sine_square = np.clip((1.0 - along**2) / (across**2 - along**2), 0.0, 1.0)
    edge = float(np.arcsin(np.sqrt(sine_square)))
    if cut.sum() <= 1:
        return np.linspace(edge, np.pi - edge, RINGS)
    return np.concatenate([np.linspace(0.0, edge, RINGS // 2), np.linspace(np.pi - edge, np.pi, RINGS // 2)])


def _note(lengths: Array, cut: Mask) -> str:
    """Return what an ellipsoid with these lengths and cut axes is, in words."""
    unbounded = int(np.isinf(lengths).sum())
    if unbounded:
        shape = "a tube" if unbounded == 1 else "two plates"
        return f"degenerate: unbounded along {unbounded} of 3 axes, drawn as {shape} cut open"
    ratio = float(lengths.max() / lengths.min())
    return f"{'cut open: ' if cut.any() else ''}its longest axis is {number_text(ratio)} times the shortest"
