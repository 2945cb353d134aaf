"""The arrow of a push that is tried, with a ball to drag it by, in the frame O of the object."""

from __future__ import annotations

import numpy as np
import viser

from ...drawing import look
from ..push import PushedGrasp, push_arrow
from .draw_grasp import ROOT


class PushDrawing:
    """The arrow onto the object.

    Attributes:
        handle: The ball where the arrow begins.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        none = np.zeros((1, 2, 3), np.float32)
        self._arrow = scene.add_arrows(
            f"{ROOT}/push", none, look.PUSH, shaft_radius=0.0024, head_radius=0.006, head_length=0.012
        )
        self.handle = scene.add_icosphere(f"{ROOT}/push_ball", radius=0.007, color=look.PUSH)
        self.draw(None)

    def draw(self, pushed: PushedGrasp | None) -> None:
        """Show a push; nothing if there is none."""
        self._arrow.visible = self.handle.visible = pushed is not None
        if pushed is not None:
            arrow = push_arrow(pushed.push)
            self._arrow.points = arrow[None].astype(np.float32)
            self.handle.position = arrow[0]
