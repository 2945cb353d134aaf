"""A picture of a grasp: hand, object, contacts, forces, force ellipsoid and task direction, as PNG."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LightSource, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from ..files.writing import replacing
from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..model.task import Ellipsoid
from ..spatial import Array, Pose
from ..synergies.space import SynergySpace
from .camera import good_view
from .look import Colour
from .meshes import link_meshes, link_placements
from .raster import render
from .solids import GraspScene, framed, grasp_scene

HAND_COLOUR = "#8d99ae"
PALM_COLOUR = "#5c677d"
OBJECT_COLOUR = "#e9c46a"
ELLIPSOID_SIZE = 0.06
"""Half length at which the ellipsoid's longest finite axis is drawn [m]."""
LONGEST_AXIS_RATIO = 4.0
"""Axes longer than this multiple of the shortest are cut there in the picture."""
VIEW_SIZE, HEADING, FOOTING, DPI = (620, 500), 66, 56, 120
"""Width and height of a view, height of title and legend [pixels], pixels to an inch."""
LABEL_ROOM, LABEL_WIDTH = 0.05, 0.17
"""Least distance of labels by the height of a view, and their room beside it by its width."""


def save_picture(grasp: Grasp, path: Path, *, title: str | None = None) -> None:
    """Draw a grasp into a PNG file, or an SVG file by its suffix.

    Args:
        grasp: The grasp.
        path: File to write.
        title: Title; a summary of the grasp if left out.

    Raises:
        FileFormatError: If the file can't be written.
    """
    kind = "svg" if path.suffix.lower() == ".svg" else "png"
    with replacing(path) as file:
        draw_grasp(grasp, title=title).savefig(file, format=kind, dpi=DPI)


def draw_grasp(grasp: Grasp, *, title: str | None = None) -> Figure:
    """Return a figure with two views of a grasp, newtons beside the forces and a legend.

    Args:
        grasp: The grasp.
        title: Title; a summary of the grasp if left out.

    Returns:
        A Matplotlib figure, independent of any display.
    """
    width, height = VIEW_SIZE
    figure = Figure(figsize=(2 * (1.0 + LABEL_WIDTH) * width / DPI, (height + HEADING + FOOTING) / DPI), dpi=DPI)
    FigureCanvasAgg(figure)
    scene = grasp_scene(grasp)
    eye, target = good_view(grasp)
    away = (eye - target) / np.linalg.norm(eye - target)
    above = 0.35 * away + np.array([0.0, 0.0, 1.0])
    share = height / (height + HEADING + FOOTING)
    for column, (direction, name) in enumerate(((away, "side"), (above, "from above"))):
        axes = figure.add_axes((0.5 * column, FOOTING / height * share, 0.5, share))
        show_scene(axes, scene, direction)
        axes.set_title(name, fontsize=8, color="#5c677d", y=0.97)
    figure.suptitle(title or _summary(grasp), fontsize=10, y=0.99, va="top")
    handles = [Patch(color=_rgb(colour), label=words) for colour, words in scene.legend]
    columns = (len(handles) + 1) // 2
    figure.legend(handles=handles, loc="lower center", ncols=columns, fontsize=8, frameon=False)
    return figure


def show_scene(axes: Any, scene: GraspScene, direction: Array, size: tuple[int, int] = VIEW_SIZE) -> None:
    """Show a scene as an image in plane axes, with its labels at the sides.

    Args:
        axes: Matplotlib axes.
        scene: What is to be seen.
        direction: From what is seen towards the eye, in O.
        size: Width and height [pixels].
    """
    view = framed(scene.solids, direction, *size)
    axes.imshow(render(scene.solids, view))
    axes.set_axis_off()
    width, height = size
    places = view.project(np.array([label.place for label in scene.labels]).reshape(-1, 3))[:, :2]
    # The labels stand beside the image, on the side where the contacts are.
    right = bool(len(places)) and float(np.median(places[:, 0])) >= width / 2.0
    edge, side = (width, 1.0) if right else (0.0, -1.0)
    axes.set_xlim(min(0.0, side * LABEL_WIDTH * width), max(width, edge + side * LABEL_WIDTH * width))
    order = np.argsort(places[:, 1])
    for i, row in zip(order, spread(places[order, 1] / height, LABEL_ROOM), strict=True):
        colour = _rgb(scene.labels[i].colour)
        axes.annotate(
            scene.labels[i].text,
            places[i],
            (edge + 0.01 * side * width, row * height),
            ha="left" if right else "right",
            va="center",
            fontsize=7.5,
            color=colour,
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.6, "alpha": 0.7},
        )


def spread(wanted: Array, room: float) -> Array:
    """Return places from 0 to 1 in the order of those wanted, near them and so far apart that labels have room.

    Args:
        wanted: Where they should be, ascending.
        room: Least distance.
    """
    found = np.array(wanted, dtype=float)
    for i in range(1, len(found)):
        found[i] = max(found[i], found[i - 1] + room)
    # What has run over the end is pushed back.
    for i, last in zip(range(len(found) - 1, -1, -1), np.arange(1.0, -1.0, -room), strict=False):
        found[i] = min(found[i], last - room)
    return found


def _rgb(colour: Colour) -> tuple[float, float, float]:
    """Return a colour as Matplotlib wants it."""
    red, green, blue = colour
    return red / 255.0, green / 255.0, blue / 255.0


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
