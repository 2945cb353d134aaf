"""Which side of triangles is inside: winding numbers on both sides of a surface, and in the space around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..spatial import Array
from .triangles import Triangles

if TYPE_CHECKING:
    import trimesh

PROBES = 10_000
"""Points, and most triangles, at which inside and outside are compared."""
OVERLAP_ALLOWED = 1e-3
"""Share of the surface that may lie inside the mesh itself (round-off at sharp creases)."""
NEAR = 0.1
"""Winding numbers are near a whole number within this."""


@dataclass(frozen=True)
class Sides:
    """Winding numbers just inside and just outside the triangles, and in the space around.

    Attributes:
        folded: Share of the surface with another whole number than 1 inside and 0 outside.
        unclear: Share of the surface with winding numbers that are not near whole numbers.
        negative: Share of what is inside or wound around backwards that is the latter.
        doubled: Share of what is inside that is wound around more than once.
        farthest: The largest distance of a winding number from whole numbers.
        place: Where that is, of shape (3,).
    """

    folded: float
    unclear: float
    negative: float
    doubled: float
    farthest: float
    place: Array

    @property
    def defined(self) -> bool:
        """Whether there is an inside and an outside."""
        return max(self.unclear, self.negative) <= OVERLAP_ALLOWED

    @property
    def sound(self) -> bool:
        """Whether the surface is that of a solid and nothing else."""
        return self.defined and self.folded <= OVERLAP_ALLOWED


def probed_sides(mesh: trimesh.Trimesh) -> Sides:
    """Return what winding numbers just inside and outside the triangles say; 1 and 0 for a solid."""
    import trimesh

    samples, of = trimesh.sample.sample_surface(mesh, PROBES, seed=0)
    pick = np.concatenate([np.arange(0, len(mesh.faces), 1 + len(mesh.faces) // PROBES), np.asarray(of)])
    centres = np.asarray(mesh.triangles_center)[pick]
    centres[-PROBES:] += 0.8 * (np.asarray(samples) - centres[-PROBES:])  # not on the edges of the triangles
    normals, area = np.asarray(mesh.face_normals)[pick], np.asarray(mesh.area_faces)[pick]
    # No farther off than a fraction of the triangle itself: neighbours at sharp creases are not reached.
    step = np.minimum(1e-4 * mesh.extents.max(), 0.05 * np.sqrt(area))[:, None]
    winding_number = Triangles.of(mesh).winding_number
    inside = winding_number(centres - step * normals)
    outside = winding_number(centres + step * normals)
    off = np.maximum(np.abs(inside - np.round(inside)), np.abs(outside - np.round(outside)))
    area[-PROBES:] = area.sum() / PROBES  # spread evenly already: both halves count alike
    total = max(float(area.sum()), 1e-300)
    worst = int(np.argmax(off))
    around = winding_number(np.random.default_rng(0).uniform(mesh.bounds[0], mesh.bounds[1], (PROBES, 3)))
    filled = max(int((np.abs(around) > 0.5).sum()), 1)
    return Sides(
        folded=float(area[(np.abs(inside - 1.0) > 0.5) | (np.abs(outside) > 0.5)].sum()) / total,
        unclear=float(area[off > NEAR].sum()) / total,
        negative=float((around < -0.5).sum()) / filled,
        doubled=float((around > 1.5).sum()) / filled,
        farthest=float(off[worst]),
        place=centres[worst],
    )
