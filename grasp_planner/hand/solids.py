"""The collision geometries of a hand and what does not change when it moves: balls around them, pairs to check."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from ..spatial import Array


@dataclass(frozen=True, eq=False)
class HandSolids:
    """The n collision geometries of a hand, in the order of its collision model.

    Attributes:
        geometries: Their coal geometries.
        links: Names of the links that they belong to.
        joints: Joints that carry them.
        centres: Centres of balls around them, each in its own frame [m].
        radii: Radii of the balls [m], of shape (n,).
        checked: Which pairs must not overlap, of shape (n, n), each pair once: i < j of row i and column j.
    """

    geometries: tuple[Any, ...]
    links: tuple[str, ...]
    joints: tuple[int, ...]
    centres: tuple[Array, ...]
    radii: Array
    checked: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, model: Any, collision_model: Any, ignored: Iterable[Iterable[str]]) -> HandSolids:
        """Return the solids of a hand.

        Args:
            model: Its Pinocchio model.
            collision_model: Its collision geometries.
            ignored: Pairs of links that may overlap.
        """
        entries = list(collision_model.geometryObjects)
        geometries = tuple(entry.geometry for entry in entries)
        links = tuple(model.frames[entry.parentFrame].name for entry in entries)
        joints = tuple(int(entry.parentJoint) for entry in entries)
        balls = [ball_around(geometry) for geometry in geometries]
        free = {frozenset(pair) for pair in ignored}
        checked = np.zeros((len(entries), len(entries)), dtype=bool)
        for i, j in zip(*np.triu_indices(len(entries), 1), strict=True):
            checked[i, j] = joints[i] != joints[j] and frozenset((links[i], links[j])) not in free
        radii = np.array([radius for _, radius in balls])
        return cls(geometries, links, joints, tuple(centre for centre, _ in balls), radii, checked)

    def ball_centres(self, placements: Iterable[pin.SE3]) -> Array:
        """Return the centres of the balls at placements of the geometries [m], of shape (n, 3)."""
        moved = [placement.act(centre) for placement, centre in zip(placements, self.centres, strict=True)]
        return np.array(moved).reshape(-1, 3)


def ball_around(geometry: Any) -> tuple[Array, float]:
    """Return the centre of a ball around a coal geometry, in its frame, and the radius [m]."""
    _bound(geometry)
    return np.array(geometry.aabb_center), float(geometry.aabb_radius)


def box_around(geometry: Any) -> tuple[Array, Array]:
    """Return the corners of the bounding box of a coal geometry, in its frame [m]."""
    _bound(geometry)
    return np.array(geometry.aabb_local.min_), np.array(geometry.aabb_local.max_)


def _bound(geometry: Any) -> None:
    """Have coal find the ball and the box of a geometry, once: of a mesh it goes through all triangles."""
    if geometry.aabb_radius < 0.0:
        geometry.computeLocalAABB()
