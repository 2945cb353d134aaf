"""The arrow of a push that is tried, with a ball to drag it by, in the frame O of the object."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import trimesh
import viser

from ...drawing import look
from ...grasp.grasp import Grasp
from ..push import PUSH_BEGINS, PUSH_SCALE, PushedGrasp, push_arrow
from .colours import instance_colours
from .draw_grasp import ROOT


class PushDrawing:
    """The arrow onto the object.

    Attributes:
        handle: The ball where the arrow begins.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        none = np.zeros((1, 2, 3), np.float32)
        self._arrow = scene.add_arrows(
            f"{ROOT}/push", none, instance_colours(look.PUSH), shaft_radius=0.0024, head_radius=0.006, head_length=0.012
        )
        self.handle = scene.add_icosphere(f"{ROOT}/push_ball", radius=0.007, color=look.PUSH)
        ball = trimesh.creation.icosphere(subdivisions=4)
        self._held = scene.add_mesh_simple(
            f"{ROOT}/push_held",
            np.array(ball.vertices),
            np.array(ball.faces),
            color=look.PUSH,
            opacity=0.08,
            side="back",  # so that it hides nothing of what is inside
            cast_shadow=False,
            receive_shadow=False,
        )
        self._label = scene.add_label(f"{ROOT}/push_label", "", font_screen_scale=0.9, anchor="bottom-center")
        self.draw(None, 0.0)

    def draw(self, pushed: PushedGrasp | None, margin: float) -> None:
        """Show a push, and the sphere in which its ball may be while everything holds.

        Args:
            pushed: The answer to the push; None for none.
            margin: Largest push from the weakest side that is held [N].
        """
        self._arrow.visible = self.handle.visible = self._label.visible = pushed is not None
        self._held.visible = pushed is not None and math.isfinite(margin)
        if self._held.visible:
            self._held.scale = PUSH_BEGINS + PUSH_SCALE * margin
        if pushed is not None:
            arrow = push_arrow(pushed.push)
            self._arrow.points = arrow[None].astype(np.float32)
            self.handle.position = self._label.position = arrow[0]
            # Seen through everything: the ball may be behind the hand.
            self._label.text = f"push {np.linalg.norm(pushed.push):.2f} N"


def finger_colours(grasp: Grasp, pushed: PushedGrasp) -> dict[str, look.Colour]:
    """Return the colours of the links of all fingers, by the share of its friction that each uses.

    Args:
        grasp: The grasp.
        pushed: How it answers to a push.

    Returns:
        Colours by link; a link of several fingers has that of the one that is nearest to slipping.
    """
    model, frames = grasp.problem.hand.model, grasp.problem.frames
    chains = [set(model.supports[frame.joint_id].tolist()[1:]) for frame in frames]
    order = np.argsort(pushed.use)
    colours: dict[str, look.Colour] = {}
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY:
            for index in order:
                if frame.parentJoint in chains[index]:
                    red, green, blue = (int(part) for part in pushed.colours[index])
                    colours[frame.name] = red, green, blue
    return colours
