"""The front of force against task angle as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..files.writing import replacing
from ..grasp.grasp import Grasp
from ..planning.trade import task_angle


def draw_trade(found: Sequence[Grasp], front: Sequence[Grasp], chosen: Grasp, path: Path) -> None:
    """Draw F against the angle of the task into a PNG file: all grasps, the front among them and the chosen one.

    Args:
        found: Feasible grasps.
        front: The front, by rising F.
        chosen: The grasp that was chosen.
        path: File to write.

    Raises:
        FileFormatError: If the file can't be written.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.scatter([each.force_norm for each in found], [task_angle(each) for each in found], c="0.7", label="found")
    corners = [each.force_norm for each in front], [task_angle(each) for each in front]
    axes.step(*corners, where="post", marker="o", color="tab:blue", label="front")
    axes.plot(chosen.force_norm, task_angle(chosen), "*", color="tab:orange", markersize=14, label="chosen")
    axes.set_xlabel("grasping force F [N]")
    axes.set_ylabel("task to ellipsoid's longest axis [°]")
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.grid(visible=True, which="both", alpha=0.3)
    axes.legend()
    with replacing(path) as file:
        figure.savefig(file, format="png", dpi=120)
