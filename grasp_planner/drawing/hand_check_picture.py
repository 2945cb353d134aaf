"""The picture of a hand check: the hand at rest, its proposed fingertips, palm normal and closing axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..files.writing import replacing
from ..hand.check import HandCheck
from ..hand.geometry_mesh import geometry_mesh
from ..spatial import Array
from .picture import HAND_COLOUR, PALM_COLOUR, add_mesh, frame_axes

TIP_COLOUR = "#d62828"
ARROW = 0.05
"""Length of the arrows of palm normal and closing axis in the picture [m]."""


def save_hand_picture(check: HandCheck, path: Path) -> None:
    """Draw the hand at rest, with its fingertips, palm normal and closing axis, into a PNG file.

    Args:
        check: A check without errors.
        path: File to write.

    Raises:
        FileFormatError: If the file can't be written.
    """
    figure = draw_hand_check(check)
    with replacing(path) as file:
        figure.savefig(file, format="png", dpi=120)


def draw_hand_check(check: HandCheck) -> Figure:
    """Return a figure of the hand at rest, with its fingertips, palm normal and closing axis.

    Args:
        check: A check without errors.

    Returns:
        A Matplotlib figure, independent of any display.
    """
    figure = Figure(figsize=(9.0, 4.8))
    FigureCanvasAgg(figure)
    for column, (elevation, azimuth) in enumerate(((15.0, -60.0), (20.0, 30.0))):
        axes = figure.add_subplot(1, 2, column + 1, projection="3d")
        frame_axes(axes, _draw(axes, check))
        axes.view_init(elev=elevation, azim=azimuth)
    figure.suptitle(f"{check.name}: palm normal (red), closing axis (blue), proposed contacts (red balls)", fontsize=9)
    return figure


def _draw(axes: object, check: HandCheck) -> Array:
    """Draw links, tips and arrows; return the corners of all that was drawn."""
    assert check.urdf is not None and check.palm is not None
    model, geometry = check.urdf.model, check.urdf.collision_model
    data, placements = model.createData(), geometry.createData()
    q = np.clip(np.zeros(model.nq), model.lowerPositionLimit, model.upperPositionLimit)
    pin.framesForwardKinematics(model, data, q)
    pin.updateGeometryPlacements(model, data, geometry, placements, q)
    corners = []
    for entry, placement in zip(geometry.geometryObjects, placements.oMg, strict=True):
        mesh = geometry_mesh(entry.geometry).copy()
        mesh.apply_transform(placement.homogeneous)
        add_mesh(axes, mesh, PALM_COLOUR if entry.parentJoint == 0 else HAND_COLOUR, 0.6)
        corners.append(mesh.bounds)
    for name, tip in ((finger.name, tip) for finger in check.fingers for tip in finger.tips):
        frame = model.getFrameId(tip.frame, pin.FrameType.BODY)
        centre = data.oMf[frame].act(np.array(tip.offset))
        axes.scatter(*centre, color=TIP_COLOUR, s=30, depthshade=False)  # type: ignore[attr-defined]
        axes.text(*centre, name, fontsize=6)  # type: ignore[attr-defined]
        corners.append(np.array([centre, centre]))
    palm = data.oMf[model.getFrameId(check.palm.link, pin.FrameType.BODY)]
    start = palm.act(check.palm.grasp_centre)
    for direction, colour in ((check.palm.normal, TIP_COLOUR), (check.palm.closing_axis, "#4361ee")):
        arrow = ARROW * (palm.rotation @ direction)
        axes.quiver(*start, *arrow, color=colour)  # type: ignore[attr-defined]
    return np.vstack(corners)
