"""The picture of a hand check: fingers, contact patches and their errors, palm axes, how it closes, what it reaches."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from ..files.writing import replacing
from ..hand.check import HandCheck
from ..hand.configuration import HandConfiguration
from ..hand.contact_frame import ContactFrame
from ..hand.geometry_mesh import geometry_mesh
from ..hand.hand import Hand
from ..hand.loading import checked_hand
from ..hand.proposal import first_command
from ..hand.workspace import find_workspace
from ..spatial import Array
from .picture import HAND_COLOUR, PALM_COLOUR, add_mesh, frame_axes

RED, BLUE, VIOLET = "#d62828", "#4361ee", "#7b2cbf"
SYNERGY_COLOURS = (RED, BLUE, "#2a9d8f")
"""Colours of the ways of the contacts along the first synergies."""
ARROW = 0.05
"""Length of the arrows of palm normal and closing axis in the picture [m]."""
CONTACTS = "sphere"
"""The contact set that has every finger."""
WHOLE = (1.2, 1.2)
"""Half angles of the ball that is drawn of a contact without a patch [rad]."""
CORNERS = 5
"""Points along each side of a patch."""
STEPS = 15
"""Points along the way of a contact."""
STAND = 3.0
"""Size of what is fixed to the palm, as a multiple of the fingers', from which on it is a stand and not drawn."""
ZOOM = 1.35
"""Factor on the size of a drawing without axes."""
DOTS = 1500
"""Most places of a finger that are drawn."""
LINE = 62
"""Characters of a line of text."""


def save_hand_picture(check: HandCheck, path: Path) -> None:
    """Draw what a check found into a PNG file.

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
    """Return a figure of what a check found, all of it in the palm frame.

    Two views of the open hand with contact patches, palm normal and closing axis; the ways of the contacts along the
    first synergies, the hand at the end of the first; what the opposing finger reaches and where others do; in words,
    fingers, errors of the patches and the command that plans a first grasp.

    Args:
        check: A check without errors.

    Returns:
        A Matplotlib figure, independent of any display.
    """
    figure = Figure(figsize=(14.0, 8.6))
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 3, left=0.01, right=0.99, bottom=0.02, top=0.91, wspace=0.06, hspace=0.12)
    hand = checked_hand(check).hand
    for column, azimuth in enumerate((-60.0, 30.0)):
        axes = figure.add_subplot(grid[0, column], projection="3d")
        _draw_open(axes, check, hand)
        axes.view_init(elev=18.0, azim=azimuth)
        _without_axes(axes)
        axes.set_title("open: contact patches; palm normal (red) and closing axis (blue), 5 cm each", fontsize=8)
    axes = figure.add_subplot(grid[1, 0], projection="3d")
    _draw_closing(axes, hand)
    _without_axes(axes)
    axes.view_init(elev=18.0, azim=-60.0)
    axes = figure.add_subplot(grid[1, 1], projection="3d")
    _draw_workspace(axes, check, hand)
    axes.view_init(elev=18.0, azim=-60.0)
    words = figure.add_subplot(grid[:, 2])
    words.set_axis_off()
    words.text(0.0, 1.0, "\n".join(check_words(check)), va="top", fontsize=7.5, family="monospace", wrap=False)
    figure.suptitle(f"{check.name}: what was found in {check.path.name}", fontsize=11)
    return figure


def check_words(check: HandCheck) -> list[str]:
    """Return what a check found in lines: fingers with their contacts, the palm, repairs, notes, the first command."""
    assert check.description is not None
    palm = check.description.palm
    found = []
    for finger in check.fingers:
        found.append(f"{finger.name}: {len(finger.joints)} joints")
        found += [f"  {tip.link}: {tip.reason}, radius {1e3 * tip.radius:.1f} mm" for tip in finger.tips]
    found.append(f"palm {palm.link}: normal {_short(palm.normal)}, closing axis {_short(palm.closing_axis)}")
    repairs = len(check.repairs)
    found += [f"{repairs} repair{'s' if repairs > 1 else ''}; hand check lists them"] if repairs else []
    found += [f"note: {line}" for line in check.notes]
    found += ["", "first grasp:", first_command(check)]
    wrapped = (textwrap.wrap(each, LINE, subsequent_indent="    ", break_on_hyphens=False) or [""] for each in found)
    return [line for lines in wrapped for line in lines]


def _short(vector: tuple[float, ...]) -> str:
    """Return a unit vector in a few characters."""
    return "(" + " ".join(f"{value:+.2f}" for value in vector) + ")"


def _open(check: HandCheck, hand: Hand) -> Array:
    """Return the open posture with the fingers opposed [rad or m], of shape (n_q,)."""
    assert check.derived is not None
    closing = check.derived.closing
    angles = closing.motion.coupling @ closing.rest + closing.motion.offset
    by_name = dict(zip(tuple(closing.motion.model.names)[1:], angles.tolist(), strict=True))
    return np.clip([by_name[name] for name in hand.joint_names], hand.lower, hand.upper)


def _draw_links(axes: Any, hand: Hand, q: Array, opacity: float) -> Array:
    """Draw the collision geometry of a posture, without stands; return the corners of all links drawn."""
    poses = HandConfiguration(hand, q).geometry_poses
    placed = []
    for entry, pose in zip(hand.collision_model.geometryObjects, poses, strict=True):
        mesh = geometry_mesh(entry.geometry).copy()
        mesh.apply_transform(pose.homogeneous)
        placed.append((mesh, int(entry.parentJoint) == 0))
    moving = np.vstack([mesh.bounds for mesh, at_root in placed if not at_root] or [mesh.bounds for mesh, _ in placed])
    most = STAND * float(np.ptp(moving, axis=0).max())
    drawn = [(mesh, at_root) for mesh, at_root in placed if not at_root or mesh.extents.max() < most]
    for mesh, at_root in drawn:
        add_mesh(axes, mesh, PALM_COLOUR if at_root else HAND_COLOUR, opacity)
    return np.vstack([mesh.bounds for mesh, _ in drawn])


def _draw_open(axes: Any, check: HandCheck, hand: Hand) -> None:
    """Draw the open hand with its contacts, palm normal and closing axis."""
    q = _open(check, hand)
    corners = _draw_links(axes, hand, q, 0.35)
    at, frames = HandConfiguration(hand, q), hand.contact_frames(CONTACTS)
    for frame, centre in zip(frames, at.contact_centres(frames), strict=True):
        rotation = at.joint_poses[frame.joint_id].rotation
        faces = patch_faces(frame) @ rotation.T + centre
        axes.add_collection3d(Poly3DCollection(faces, facecolors=RED, edgecolors=RED, linewidths=0.8, zorder=10))
        axes.scatter(*faces.mean(axis=(0, 1)), color=RED, s=9, depthshade=False)
        axes.text(*centre, f"  {frame.name}", fontsize=7)
    palm = hand.description.palm
    start = np.array(palm.grasp_centre)
    for direction, colour in ((palm.normal, RED), (palm.closing_axis, BLUE)):
        axes.quiver(*start, *(ARROW * np.array(direction)), color=colour)
    frame_axes(axes, np.vstack([corners, start]))


def _without_axes(axes: Any) -> None:
    """Leave out the axes, and use their room."""
    axes.set_axis_off()
    axes.set_box_aspect((1, 1, 1), zoom=ZOOM)


def patch_faces(frame: ContactFrame) -> Array:
    """Return the part of a contact's ball that is the link's surface, about its centre, in the frame of its joint.

    Args:
        frame: The contact; of one without a patch most of the ball stands for it.

    Returns:
        Corners of quadrilaterals [m], of shape (n, 4, 3).
    """
    normal = np.array(frame.normal if frame.normal is not None else (0.0, 0.0, 1.0))
    across = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    bend, side = WHOLE
    if frame.patch is not None:
        normal, across = np.array(frame.patch.normal), np.array(frame.patch.across)
        bend, side = frame.patch.bend, frame.patch.side
    across = across / np.linalg.norm(across)
    along = np.cross(across, normal)
    about, aside = np.meshgrid(np.linspace(-bend, bend, CORNERS), np.linspace(-side, side, CORNERS), indexing="ij")
    ring = np.cos(about)[..., None] * normal + np.sin(about)[..., None] * along
    points = frame.radius * (np.cos(aside)[..., None] * ring + np.sin(aside)[..., None] * across)
    corners = (points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:])
    return np.stack(corners, axis=2).reshape(-1, 4, 3)


def _draw_closing(axes: Any, hand: Hand) -> None:
    """Draw the ways of all contacts along the first synergies, and the hand at the end of the first."""
    space, frames = hand.synergies(), hand.contact_frames(CONTACTS)
    count = min(len(SYNERGY_COLOURS), space.n_synergies)
    corners = []
    for k in reversed(range(count)):
        ways = np.array([HandConfiguration(hand, q).contact_centres(frames) for q in synergy_way(hand, k)])
        for way in ways.transpose(1, 0, 2):
            axes.plot(*way.T, color=SYNERGY_COLOURS[k], linewidth=1.6 if k == 0 else 1.0)
        corners.append(ways.reshape(-1, 3))
    corners.append(_draw_links(axes, hand, synergy_way(hand, 0)[-1], 0.25))
    frame_axes(axes, np.vstack(corners))
    colours = ", ".join(f"σ{k + 1} {name}" for k, name in enumerate(("red", "blue", "green")[:count]))
    axes.set_title(f"set {space.name}: where contacts go along {colours}", fontsize=8)


def synergy_way(hand: Hand, k: int) -> Array:
    """Return postures along a synergy of the default set, as far as joint limits let it, of shape (n, n_q).

    The first set closes from its open end; at a limit a joint stays there while the others go on.
    """
    space = hand.synergies()
    column = space.basis[:, k]
    moving = np.abs(column) > 1e-9
    ends = np.array(
        [(hand.lower - space.mean)[moving] / column[moving], (hand.upper - space.mean)[moving] / column[moving]]
    )
    first, last = np.median(ends.min(axis=0)), np.median(ends.max(axis=0))
    sigma = np.linspace(first, last, STEPS)
    return np.clip(space.mean + sigma[:, None] * column, hand.lower, hand.upper)


def _draw_workspace(axes: Any, check: HandCheck, hand: Hand) -> None:
    """Draw what the opposing finger reaches and what the others do."""
    found = find_workspace(hand, CONTACTS, len(check.fingers[0].tips), np.random.default_rng(0))
    kinds = ((found.others, "#adb5bd"), (found.thumb[~found.shared], RED), (found.thumb[found.shared], VIOLET))
    for places, colour in kinds:
        some = places[:: max(1, len(places) // DOTS)]
        axes.scatter(*some.T, color=colour, s=1.5, depthshade=False)
    frame_axes(axes, np.vstack([found.thumb, found.others]))
    title = f"{check.fingers[0].name} reaches {1e6 * found.volume:.0f} cm³ (red)"
    if len(check.fingers) > 1:
        title += f", {found.overlap:.0%} where others (grey) reach too (violet)"
    axes.set_title(title, fontsize=8)
    axes.set(xlabel="", ylabel="", zlabel="")
