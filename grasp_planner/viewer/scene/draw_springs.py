"""Springs between fingertips and where their references are, each with its newtons."""

from __future__ import annotations

import numpy as np
import viser

from ...drawing import look
from ...grasp.grasp import Grasp
from ...model.contacts import fingertip_positions
from ...spatial import Array
from .draw_grasp import ROOT

TURNS, WIDTH = 7, 0.0022
"""Zigzags of a spring, and how far they reach to the side [m]."""


class SpringDrawing:
    """The springs of a closing hand, in the frame O of the object."""

    def __init__(self, scene: viser.SceneApi, contacts: int) -> None:
        none = np.zeros((1, 2, 3), np.float32)
        self._lines = scene.add_line_segments(
            f"{ROOT}/springs", none, look.REFERENCE_GHOST, thickness=3.0, thickness_units="screen", visible=False
        )
        self._labels = [
            scene.add_label(f"{ROOT}/spring_{index}", "", visible=False, font_screen_scale=0.8, anchor="bottom-center")
            for index in range(contacts)
        ]

    def draw(self, springs: Array, forces: Array) -> None:
        """Show springs, of shape (k, 2, 3) [m], with their forces [N], of shape (k,); none if there are none."""
        self._lines.visible = bool(len(springs))
        if len(springs):
            self._lines.points = np.concatenate([zigzag(begin, end) for begin, end in springs]).astype(np.float32)
        for index, label in enumerate(self._labels):
            label.visible = index < len(springs)
            if index < len(springs):
                label.text, label.position = f"{forces[index]:.1f} N", springs[index].mean(axis=0)


def resting_springs(grasp: Grasp) -> tuple[Array, Array]:
    """Return the springs of a grasp at rest: from its fingertips to where the motors alone would put them.

    Returns:
        Both ends in O [m], of shape (n_c, 2, 3), and how hard the finger presses [N], of shape (n_c,).
    """
    hand, frames, palm = grasp.problem.hand, grasp.problem.frames, grasp.palm_pose
    ends = [fingertip_positions(hand, frames, q, palm) for q in (grasp.joint_angles, grasp.reference_joint_angles)]
    return np.stack(ends, axis=1), np.linalg.norm(grasp.forces, axis=1)


def zigzag(begin: Array, end: Array) -> Array:
    """Return the segments of a spring between two points [m], of shape (n, 2, 3)."""
    way = end - begin
    across = np.cross(way, [0.0, 0.0, 1.0] if abs(way[2]) < 0.9 * np.linalg.norm(way) else [1.0, 0.0, 0.0])
    across *= WIDTH / max(float(np.linalg.norm(across)), 1e-12)
    share = np.linspace(0.0, 1.0, 2 * TURNS + 1)[:, None]
    side = np.resize([0.0, 1.0, 0.0, -1.0], 2 * TURNS + 1)[:, None]
    points = begin + share * way + side * across
    return np.stack([points[:-1], points[1:]], axis=1)
