"""A picture of a grasp: hand, object, contacts, forces, force ellipsoid and task direction, as PNG."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LightSource, to_rgb
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from ..files.writing import replacing
from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..model.task import Ellipsoid, transmission_ellipsoid
from ..spatial import Array, Pose
from ..synergies.space import SynergySpace
from .meshes import link_meshes, link_placements, object_mesh

HAND_COLOUR = "#8d99ae"
PALM_COLOUR = "#5c677d"
OBJECT_COLOUR = "#e9c46a"
FORCE_COLOUR = "#d62828"
TASK_COLOUR = "#1d6f42"
ELLIPSOID_COLOUR = "#4361ee"
FORCE_ARROW = 0.05
"""Length of the longest force arrow [m]."""
TASK_ARROW = 0.09
"""Length of the arrow of a task direction [m]."""
ELLIPSOID_SIZE = 0.06
"""Half length at which the ellipsoid's longest finite axis is drawn [m]."""
LONGEST_AXIS_RATIO = 4.0
"""Axes longer than this multiple of the shortest are cut there in the picture."""
VIEWS = ((18.0, 0.0, "side"), (65.0, 0.0, "from above"))
"""Elevation, azimuth from the palm's side [degrees] and title of each view."""


def save_picture(grasp: Grasp, path: Path, *, title: str | None = None) -> None:
    """Draw a grasp into a PNG file.

    Args:
        grasp: The grasp.
        path: File to write.
        title: Title; a summary of the grasp if left out.

    Raises:
        FileFormatError: If the file can't be written.
    """
    _write_png(draw_grasp(grasp, title=title), path)


def draw_grasp(grasp: Grasp, *, title: str | None = None) -> Figure:
    """Return a figure with two views of a grasp.

    Args:
        grasp: The grasp.
        title: Title; a summary of the grasp if left out.

    Returns:
        A Matplotlib figure, independent of any display.
    """
    figure = Figure(figsize=(12.0, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    palm = np.array(grasp.palm_pose.act(grasp.problem.hand.palm_in_root.translation))
    facing = np.degrees(np.arctan2(palm[1], palm[0]))
    for column, (elevation, turn, name) in enumerate(VIEWS):
        axes = figure.add_subplot(1, 2, column + 1, projection="3d")
        draw_scene(axes, grasp)
        axes.view_init(elev=elevation, azim=facing + 90.0 + turn)
        axes.set_title(name, fontsize=9)
    figure.suptitle(title or _summary(grasp), fontsize=11)
    return figure


def draw_scene(axes: Any, grasp: Grasp) -> None:
    """Draw hand, object, contacts, forces, task directions and the force ellipsoid into 3-D axes.

    Args:
        axes: Matplotlib 3-D axes.
        grasp: The grasp.
    """
    problem = grasp.problem
    corners = draw_hand(axes, problem.hand, grasp.joint_angles, grasp.palm_pose, opacity=0.55)
    add_mesh(axes, object_mesh(problem.grasp_object), OBJECT_COLOUR, 0.35)
    _draw_forces(axes, grasp)
    arrows = _draw_tasks(axes, grasp)
    frame_axes(axes, np.vstack([corners, arrows, object_mesh(problem.grasp_object).bounds]))


def save_synergy_strip(hand: Hand, space: SynergySpace, path: Path) -> None:
    """Draw the hand along each synergy, from −2 to +2 standard deviations, into a PNG file.

    Args:
        hand: The hand.
        space: The synergies to draw, one row each.
        path: File to write.

    Raises:
        FileFormatError: If the file can't be written.
    """
    _write_png(draw_synergy_strip(hand, space), path)


def draw_synergy_strip(hand: Hand, space: SynergySpace) -> Figure:
    """Return a figure of the hand along each synergy, from −2 to +2 standard deviations.

    Args:
        hand: The hand.
        space: The synergies to draw, one row each; where their variances are not known, a deviation is 0.3 rad.

    Returns:
        A Matplotlib figure, independent of any display.
    """
    steps = (-2.0, -1.0, 0.0, 1.0, 2.0)
    figure = Figure(figsize=(2.4 * len(steps), 2.6 * space.n_synergies), layout="constrained")
    FigureCanvasAgg(figure)
    deviation = np.full(space.n_synergies, 0.3) if space.variance is None else np.sqrt(space.variance)
    for k in range(space.n_synergies):
        for column, step in enumerate(steps):
            axes = figure.add_subplot(space.n_synergies, len(steps), k * len(steps) + column + 1, projection="3d")
            sigma = np.zeros(space.n_synergies)
            sigma[k] = step * deviation[k]
            posture = np.clip(space.joint_angles(sigma), hand.lower, hand.upper)
            frame_axes(axes, draw_hand(axes, hand, posture))
            axes.set_axis_off()
            axes.view_init(elev=20.0, azim=35.0)
            axes.set_title(f"σ{k + 1} = {sigma[k]:+.2f} rad", fontsize=9)
    figure.suptitle(f"{space.name}: from −2 to +2 standard deviations along each synergy")
    return figure


def ellipsoid_mesh(ellipsoid: Ellipsoid) -> tuple[trimesh.Trimesh, bool]:
    """Return a drawable mesh of an ellipsoid, of a fixed size, and whether a long axis had to be cut.

    Degenerate ellipsoids are drawn as what they are: cut where they are unbounded.

    Args:
        ellipsoid: The ellipsoid.

    Returns:
        Mesh around the origin [m], and the flag.
    """
    finite = ellipsoid.lengths[np.isfinite(ellipsoid.lengths)]
    shortest = float(finite.min()) if finite.size else 1.0
    lengths = np.minimum(ellipsoid.lengths, LONGEST_AXIS_RATIO * shortest)
    cut = bool((ellipsoid.lengths > lengths).any())
    mesh = trimesh.creation.icosphere(subdivisions=3)
    mesh.apply_scale(lengths * ELLIPSOID_SIZE / lengths.max())
    transform = np.eye(4)
    transform[:3, :3] = ellipsoid.axes
    mesh.apply_transform(transform)
    return mesh, cut


def draw_hand(
    axes: Any,
    hand: Hand,
    q: Array,
    palm_in_object: Pose | None = None,
    *,
    opacity: float = 1.0,
    colour: str | None = None,
) -> Array:
    """Draw the links of a hand into 3-D axes.

    Args:
        axes: Matplotlib 3-D axes.
        hand: The hand.
        q: Independent joint angles [rad], of shape (n_q,).
        palm_in_object: Pose of the palm frame in O; if left out, the picture is in the palm frame.
        opacity: From 0 to 1.
        colour: Colour of all links; grey, the palm darker, if left out.

    Returns:
        Corners of the bounding boxes of the links [m], of shape (n, 3), for :func:`frame_axes`.
    """
    placements = link_placements(hand, q, Pose.identity() if palm_in_object is None else palm_in_object)
    corners = []
    for link in link_meshes(hand):
        mesh = link.mesh.copy()
        mesh.apply_transform(placements[link.geometry_id].homogeneous)
        of_kind = PALM_COLOUR if link.link == hand.description.palm.link else HAND_COLOUR
        add_mesh(axes, mesh, colour or of_kind, opacity)
        corners.append(mesh.bounds)
    return np.vstack(corners)


def _write_png(figure: Figure, path: Path) -> None:
    """Write a figure."""
    with replacing(path) as file:
        figure.savefig(file, format="png", dpi=120)


def _summary(grasp: Grasp) -> str:
    """Return the title of a grasp."""
    angle, degenerate = grasp.alignments[0]
    flag = " (degenerate ellipsoid)" if degenerate else ""
    return (
        f"{grasp.problem.hand.description.title or grasp.problem.hand.name} · {grasp.problem.grasp_object.kind} · "
        f"task {', '.join(task.text for task in grasp.problem.tasks)} · {grasp.problem.n_synergies} synergies\n"
        f"{grasp.status}: F = {grasp.force_norm:.2f} N (floor {grasp.force_norm_floor:.2f} N), "
        f"angle {angle:.1f}°{flag}"
    )


def add_mesh(axes: Any, mesh: trimesh.Trimesh, colour: str, opacity: float) -> None:
    """Add a shaded mesh."""
    shade = LightSource(azdeg=315, altdeg=50).shade_normals(mesh.face_normals, fraction=0.7)
    faces = np.clip(np.outer(0.45 + 0.55 * shade, to_rgb(colour)), 0.0, 1.0)
    rgba = np.column_stack([faces, np.full(len(faces), opacity)])
    axes.add_collection3d(Poly3DCollection(mesh.triangles, facecolors=rgba, linewidths=0.0))


def _draw_forces(axes: Any, grasp: Grasp) -> None:
    """Draw contact points and the forces of the hand on the object, pointing at the contacts."""
    points, forces = grasp.contacts.points, grasp.forces
    axes.scatter(*points.T, color="black", s=14, depthshade=False)
    largest = float(np.linalg.norm(forces, axis=1).max())
    if largest > 0.0:
        arrows = forces * (FORCE_ARROW / largest)
        axes.quiver(*(points - arrows).T, *arrows.T, color=FORCE_COLOUR, linewidth=1.8, arrow_length_ratio=0.25)


def _draw_tasks(axes: Any, grasp: Grasp) -> list[Array]:
    """Draw the task directions from the object's centre, and the force ellipsoid; return the tips of the arrows."""
    tips = []
    for task in grasp.problem.tasks:
        part = task.direction[3:] if task.kind == "torque" else task.direction[:3]
        style = "--" if task.is_motion else "-"
        tips.append(TASK_ARROW * part)
        axes.quiver(0, 0, 0, *tips[-1], color=TASK_COLOUR, linewidth=2.4, linestyle=style)
    mesh, _ = ellipsoid_mesh(transmission_ellipsoid(grasp.object_synergy_map, "force"))
    add_mesh(axes, mesh, ELLIPSOID_COLOUR, 0.18)
    return tips


def frame_axes(axes: Any, corners: Array) -> None:
    """Set equal scales around everything drawn."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre, half = (low + high) / 2, float((high - low).max()) / 2
    axes.set(
        xlim=(centre[0] - half, centre[0] + half),
        ylim=(centre[1] - half, centre[1] + half),
        zlim=(centre[2] - half, centre[2] + half),
        xlabel="x [m]",
        ylabel="y [m]",
        zlabel="z [m]",
    )
    axes.set_box_aspect((1, 1, 1), zoom=1.25)
    axes.tick_params(labelsize=6)
