"""What a grasp withstands: words for the panel and an arrow from the side where it is weakest."""

from __future__ import annotations

import math

import numpy as np
import viser

from ...grasp.grasp import Grasp
from ...spatial import Array
from .colours import instance_colours
from .draw_grasp import ROOT

COLOUR = (160, 32, 100)
MARGIN_SCALE = 0.02
"""Length of the margin's arrow [m/N]."""
SHORTEST, LONGEST = 0.02, 0.12
"""Shortest and longest arrow drawn [m]."""


def withstands(grasp: Grasp) -> str:
    """Return a paragraph (Markdown): the push it resists where it is weakest, what gives way, and its stability."""
    margin = grasp.passive_margin
    if math.isnan(margin.size):
        return "**What it withstands.** Not defined without contact stiffness."
    if math.isinf(margin.size):
        push = "Any push"
    elif margin.size < 0.01:
        push = "The slightest push from its weakest side makes it slip: a plan at the least force has no margin"
    else:
        push = f"Any push up to **{margin.size:.2f} N**; then {margin.gives_way} gives way"
    return f"**What it withstands.** {push}. As a spring it is {grasp.stability.text}."


class MarginDrawing:
    """An arrow onto the object along the push that it resists least, as long as the largest push resisted."""

    def __init__(self, scene: viser.SceneApi) -> None:
        none = np.zeros((1, 2, 3), np.float32)
        self._arrow = scene.add_arrows(
            f"{ROOT}/margin", none, instance_colours(COLOUR), shaft_radius=0.0016, head_radius=0.004, head_length=0.008
        )
        self._arrow.visible = False

    def draw(self, grasp: Grasp, *, shown: bool) -> None:
        """Show the arrow of a feasible grasp.

        Args:
            grasp: The grasp.
            shown: Whether it is wanted.
        """
        arrow = margin_arrow(grasp) if shown and grasp.feasible else None
        self._arrow.visible = arrow is not None
        if arrow is not None:
            self._arrow.points = arrow[None].astype(np.float32)


def margin_arrow(grasp: Grasp) -> Array | None:
    """Return begin and end of the arrow in O [m], of shape (2, 3); None where nothing gives way."""
    margin = grasp.passive_margin
    if not math.isfinite(margin.size):
        return None
    direction = margin.direction[:3]
    surface = -direction * float(grasp.problem.grasp_object.half_extents.max())
    length = float(np.clip(MARGIN_SCALE * margin.size, SHORTEST, LONGEST))
    return np.array([surface - length * direction, surface])
