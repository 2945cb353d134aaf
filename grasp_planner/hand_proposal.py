"""What follows from a hand check: a description file to start from, a report and a picture."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from .exceptions import FileFormatError
from .hand_check import FingerReport, HandCheck
from .meshes import geometry_mesh
from .picture import HAND_COLOUR, PALM_COLOUR, add_mesh, frame_axes
from .spatial import Array

TIP_COLOUR = "#d62828"
ARROW = 0.05
"""Length of the arrows of palm normal and closing axis in the picture [m]."""


def proposed_description(check: HandCheck, folder: Path | None = None) -> str:
    """Return the text of a description file (TOML) for a hand.

    Args:
        check: A check without errors.
        folder: Folder the file will be in; that of the URDF if left out.

    Returns:
        The text; what is guessed says so.
    """
    assert check.palm is not None
    urdf = (
        check.path.name if folder is None or folder.resolve() == check.path.parent.resolve() else check.path.resolve()
    )
    joints = [joint.name for joint in check.joints if not joint.mimics]
    palm = check.palm
    lines = [
        f"# Proposed from {check.path.name}; everything marked `guess` needs a look. SI units: m, rad, N.",
        f"name = {json.dumps(check.name)}",
        f"urdf = {json.dumps(str(urdf))}",
        "# The independent joints in the order of q; joints with a <mimic> follow them.",
        f"joints = {json.dumps(joints)}",
        "",
        "[palm]",
        f"link = {json.dumps(palm.link)}",
        f"normal = {_vector(palm.normal)}       # guess: where the fingertips go when the fingers close",
        f"closing_axis = {_vector(palm.closing_axis)} # guess: what they close around",
        f"grasp_centre = {_vector(palm.grasp_centre)} # guess: middle of the half-closed fingertips",
        "",
        "[compliance] # guess: the numbers of [Mavrogiannis2014]",
        "joint = 0.1             # C_q [rad/(N m)]; or a table with one number a joint",
        "structural = 0.1        # C_s [m/N]",
        "contact_stiffness = 1e5 # K_c [N/m]",
        "",
        "[contact_sets.sphere]",
        *(_contact(finger) for finger in check.fingers),
        "",
        "[collision] # neighbours in a chain",
        "ignore = [",
        *(f"  {json.dumps(list(pair))}," for pair in check.ignored),
        "]",
    ]
    return "\n".join(lines) + "\n"


def report_lines(check: HandCheck) -> list[str]:
    """Return the findings as lines of text."""
    lines = [f"{check.path}: {check.name}, {len(check.joints)} moving joints, {len(check.fingers)} fingers"]
    for finger in check.fingers:
        tip = finger.tip
        lines.append(f"finger {finger.name}: {' → '.join(finger.joints)}")
        lines.append(f"  tip {tip.frame} + {list(tip.offset)} m, radius {tip.radius:g} m ({tip.reason})")
    for joint in check.joints:
        follows = f", follows {joint.mimics}" if joint.mimics else ""
        lines.append(f"joint {joint.name}: {joint.lower:.4g} … {joint.upper:.4g} rad{follows}")
    if check.palm is not None:
        lines.append(
            f"palm {check.palm.link}: normal {_vector(check.palm.normal)}, closing axis "
            f"{_vector(check.palm.closing_axis)}, grasp centre {_vector(check.palm.grasp_centre)} m"
        )
    lines += [f"missing: {line}" for line in check.missing]
    return lines + [f"error: {line}" for line in check.errors]


def save_hand_picture(check: HandCheck, path: Path) -> None:
    """Draw the hand at rest, with its fingertips, palm normal and closing axis, into a PNG file.

    Args:
        check: A check without errors.
        path: File to write.

    Raises:
        FileFormatError: If the file can't be written.
    """
    try:
        draw_hand_check(check).savefig(path, format="png", dpi=120)
    except OSError as error:
        raise FileFormatError(path, f"can't be written: {error.strerror or error}") from None


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
    for finger in check.fingers:
        frame = model.getFrameId(finger.tip.frame, pin.FrameType.BODY)
        centre = data.oMf[frame].act(np.array(finger.tip.offset))
        axes.scatter(*centre, color=TIP_COLOUR, s=30, depthshade=False)  # type: ignore[attr-defined]
        axes.text(*centre, finger.name, fontsize=6)  # type: ignore[attr-defined]
        corners.append(np.array([centre, centre]))
    palm = data.oMf[model.getFrameId(check.palm.link, pin.FrameType.BODY)]
    start = palm.act(check.palm.grasp_centre)
    for direction, colour in ((check.palm.normal, TIP_COLOUR), (check.palm.closing_axis, "#4361ee")):
        arrow = ARROW * (palm.rotation @ direction)
        axes.quiver(*start, *arrow, color=colour)  # type: ignore[attr-defined]
    return np.vstack(corners)


def _contact(finger: FingerReport) -> str:
    """Return the line of a contact."""
    tip = finger.tip
    offset = f", offset = {list(tip.offset)}" if any(tip.offset) else ""
    return (
        f"{finger.name} = {{ frame = {json.dumps(tip.frame)}, radius = {tip.radius:g}{offset} }} # guess: {tip.reason}"
    )


def _vector(vector: Array) -> str:
    """Return a vector as TOML."""
    return "[" + ", ".join(f"{value + 0.0:.4f}" for value in np.round(vector, 4)) + "]"
