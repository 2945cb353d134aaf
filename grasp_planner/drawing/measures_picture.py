"""What a grasp can exert, how stiffly it holds and where motors move the object: in the three planes, and in space."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.measured_contacts import ContactSet
from ..analysis.wrench_space import epsilon, reach
from ..exceptions import InvalidValueError
from ..files.writing import replacing
from ..model.quasi_static import CompliantGrasp, quasi_static_maps
from ..spatial import Array
from .ellipsoid_axes import draw_ellipsoids
from .raster import Pixels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLANES = ((0, 1), (0, 2), (1, 2))
ANGLES = 72
"""Rays of a slice."""
WIDE, NARROW = 10.0, 6.5
"""Width in a file and beside the picture of the page [inch]."""


def draw_measures(contacts: ContactSet, path: Path) -> None:
    """Draw the slices into a PNG file.

    Args:
        contacts: The contacts.
        path: File to write.

    Raises:
        FileFormatError: If the file can't be written.
    """
    figure = measures_figure(contacts)
    with replacing(path) as file:
        figure.savefig(file, format="png", dpi=120)


def measures_pixels(contacts: ContactSet) -> Pixels:
    """Return the slices as a small picture, narrower than in a file.

    Args:
        contacts: The contacts.

    Returns:
        RGB values, of shape (height, width, 3).
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = measures_figure(contacts, width=NARROW)
    figure.set_dpi(150)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def measures_figure(contacts: ContactSet, width: float = WIDE) -> Figure:
    """Return a figure: wrench space with ε, displacement under a force, reach of the motors; one column a plane.

    Forces and displacements are slices, moments zero; the reach of the motors is the shadow of an ellipsoid. Below
    them stand the ellipsoids of stiffness and of kinematic and force manipulability.

    Args:
        contacts: The contacts; without springs that hold the object there is the first row alone.
        width: Width of the figure [inch].
    """
    from matplotlib.figure import Figure

    space = contacts.wrench_space()
    radius, compliance = epsilon(space, tolerance=1e-3, max_points=250).value, _shift_compliance(contacts)
    planes, rows = (1, 1) if compliance is None else (3, 4)
    figure = Figure(figsize=(width, 0.35 * width * rows), layout="constrained")
    cells = figure.add_gridspec(rows, 3)
    grid = np.array([[figure.add_subplot(cells[row, column]) for column in range(3)] for row in range(planes)])
    turn = np.linspace(0.0, 2.0 * np.pi, ANGLES + 1)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    for axes, (first, second) in zip(grid[0], PLANES, strict=True):
        rays = np.zeros((ANGLES, 6))
        rays[:, first], rays[:, second] = circle[:-1].T
        ends = np.array([reach(space, ray)[0] for ray in rays])[:, None] * circle[:-1]
        axes.fill(*ends.T, alpha=0.3, label="forces it can exert")
        axes.plot(*(radius * circle).T, label=f"ε = {radius:.3g} N")
        axes.set(xlabel=f"{'xyz'[first]} [N]", ylabel=f"{'xyz'[second]} [N]")
        axes.set_aspect("equal", adjustable="datalim")
    grid[0, 0].legend(loc="upper right", fontsize="small")
    grid[0, 1].set_title("per 1 N of normal forces in all")
    if compliance is not None:
        for axes, plane in zip(grid[1], PLANES, strict=True):
            axes.plot(*(1e3 * circle @ compliance[np.ix_(plane, plane)]).T)
            axes.set(xlabel=f"{'xyz'[plane[0]]} [mm]", ylabel=f"{'xyz'[plane[1]]} [mm]")
            axes.set_aspect("equal", adjustable="datalim")
        grid[1, 1].set_title("where 1 N around the circle moves the object")
        assert contacts.springs is not None
        _draw_reach(contacts.springs, grid[2], circle)
        draw_ellipsoids(contacts.springs, [figure.add_subplot(cells[3, k], projection="3d") for k in range(3)])
    return figure


def _draw_reach(springs: CompliantGrasp, row: Sequence[Axes], circle: Array) -> None:
    """Draw the manipulability: where motors move the object, their references 1 rad from where they are in all."""
    moved = quasi_static_maps(springs).commands.object_motion[:3]
    for axes, plane in zip(row, PLANES, strict=True):
        left, sizes, _ = np.linalg.svd(moved[list(plane)])
        widths = np.pad(sizes, (0, 2 - len(sizes)))
        axes.plot(*(1e3 * (circle * widths) @ left.T).T)
        axes.set(xlabel=f"{'xyz'[plane[0]]} [mm]", ylabel=f"{'xyz'[plane[1]]} [mm]")
        axes.set_aspect("equal", adjustable="datalim")
    row[1].set_title("where motors of 1 rad in all move the object")


def _shift_compliance(contacts: ContactSet) -> Array | None:
    """Return the shift of the object by a force at its centre [m/N], of shape (3, 3), if springs hold it."""
    if contacts.springs is None:
        return None
    try:
        return quasi_static_maps(contacts.springs).wrench.object_motion[:3, :3]
    except InvalidValueError:
        return None
