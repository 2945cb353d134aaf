"""The ellipsoids of a grasp, drawn in space side by side: stiffness, motion, force."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import trimesh

from ..exceptions import InvalidValueError
from ..model.grasp_ellipsoids import force_ellipsoid, kinematic_ellipsoid, stiffness_ellipsoid
from ..model.quasi_static import CompliantGrasp
from ..model.task import Ellipsoid
from ..spatial import Array
from ..values import number_text
from . import look
from .shapes import Faces, ellipsoid_shape

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D


def draw_ellipsoids(springs: CompliantGrasp, row: Sequence[Axes3D]) -> None:
    """Draw stiffness against a shift, kinematic and force manipulability.

    Args:
        springs: The grasp.
        row: Three axes in space.
    """
    held = stiffness_ellipsoid(springs)
    if held is not None:
        _draw(row[0], held[1], 1e-3, "N/mm", "stiffness\nagainst a shift", look.STIFFNESS_ELLIPSOID)
    try:
        moved, rigid = kinematic_ellipsoid(springs)
        felt = force_ellipsoid(springs)
    except InvalidValueError:
        return
    by = "no spring bent" if rigid else "by the springs"
    _draw(row[1], moved, 1e3, "mm", f"motion by motors of\n1 rad in all, {by}", look.VELOCITY_ELLIPSOID)
    _draw(row[2], felt, 1.0, "N", "force that motors\nof 1 N m in all answer", look.FORCE_ELLIPSOID)


def _draw(axes: Axes3D, ellipsoid: Ellipsoid, factor: float, unit: str, title: str, colour: look.Colour) -> None:
    """Draw one ellipsoid in its own measure, open where it has no end, with its half lengths."""
    vertices, faces = _surface(ellipsoid)
    vertices = factor * vertices
    lengths = ", ".join(number_text(length) for length in factor * ellipsoid.lengths)
    axes.set_title(f"{title}\n{lengths} {unit}", fontsize="small")
    axes.tick_params(labelsize="x-small")
    axes.set(xlabel="x", ylabel="y", zlabel="z")
    axes.locator_params(nbins=5)
    if len(faces):
        axes.plot_trisurf(*vertices.T, triangles=faces, color=np.array(colour) / 255.0, alpha=0.5, linewidth=0.0)
        most = float(np.abs(vertices).max()) or 1.0
        axes.set(xlim=(-most, most), ylim=(-most, most), zlim=(-most, most))
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=0.85)  # room for the names of the axes


def _surface(ellipsoid: Ellipsoid) -> tuple[Array, Faces]:
    """Return vertices in the measure of the ellipsoid, and triangles."""
    lengths = np.asarray(ellipsoid.lengths)
    if np.isfinite(lengths).all():
        ball = trimesh.creation.icosphere(subdivisions=3)
        return np.asarray(ball.vertices * lengths @ ellipsoid.axes.T), np.asarray(ball.faces)
    shape = ellipsoid_shape(ellipsoid)
    if not len(shape.faces):
        return shape.vertices, shape.faces
    shortest = int(np.argmin(lengths))
    size = float(np.abs(shape.vertices @ ellipsoid.axes[:, shortest]).max())
    return shape.vertices * (lengths[shortest] / size), shape.faces
