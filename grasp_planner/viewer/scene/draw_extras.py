"""Small drawings beside the grasp itself, each in a class of its own, in the frame O of the object.

To draw something more, write a class like these and list it in ``EXTRAS``; a check box for it is a field of
:class:`DisplayOptions` and a line in :mod:`~grasp_planner.viewer.panels.display`.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import viser

from ...analysis.measured_contacts import contact_set
from ...drawing import look
from ...drawing.shapes import ellipsoid_shape
from ...grasp.grasp import Grasp
from ...model.grasp_ellipsoids import stiffness_ellipsoid
from ...spatial import Array
from .clearances import closest_lines
from .colours import instance_colours
from .draw_grasp import ROOT, DisplayOptions
from .margin import MarginDrawing


class ExtraDrawing(Protocol):
    """A drawing that follows the grasp; made anew, with the scene, when the hand or the object changes."""

    def __init__(self, scene: viser.SceneApi) -> None: ...

    def draw(self, grasp: Grasp, options: DisplayOptions, *, in_contact: bool) -> None:
        """Show what is asked for.

        Args:
            grasp: The grasp, or a posture on its way.
            options: What to show.
            in_contact: Whether there are contact forces.
        """


class TorqueDrawing:
    """Arrows of the joint torques, along the joint axes."""

    def __init__(self, scene: viser.SceneApi) -> None:
        none = np.zeros((1, 2, 3), np.float32)
        self._torques = scene.add_arrows(
            f"{ROOT}/torques",
            none,
            instance_colours(look.TORQUE),
            shaft_radius=0.0014,
            head_radius=0.0034,
            head_length=0.006,
        )

    def draw(self, grasp: Grasp, options: DisplayOptions, *, in_contact: bool) -> None:
        """Show the torques; see :class:`ExtraDrawing`."""
        self._torques.visible = options.torques and in_contact
        if options.torques and in_contact:
            self._torques.points = torque_arrows(grasp).astype(np.float32)


class ClearanceDrawing:
    """Lines between closest points."""

    def __init__(self, scene: viser.SceneApi) -> None:
        none = np.zeros((1, 2, 3), np.float32)
        self._lines = scene.add_line_segments(
            f"{ROOT}/clearances", none, look.SELECTED, thickness=2.0, thickness_units="screen"
        )

    def draw(self, grasp: Grasp, options: DisplayOptions, *, in_contact: bool) -> None:
        """Show the lines; see :class:`ExtraDrawing`."""
        lines = closest_lines(grasp) if options.clearances else np.zeros((0, 2, 3))
        self._lines.visible = bool(len(lines))
        if len(lines):
            # Where coal leaves a witness point open it may be huge, beyond single precision.
            self._lines.points = np.clip(lines, -1e3, 1e3).astype(np.float32)


class WeakestPushDrawing:
    """The arrow of the push that the grasp resists least."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._drawing = MarginDrawing(scene)

    def draw(self, grasp: Grasp, options: DisplayOptions, *, in_contact: bool) -> None:
        """Show the arrow; see :class:`ExtraDrawing`."""
        self._drawing.draw(grasp, shown=options.margin and in_contact)


class StiffnessDrawing:
    """The ellipsoid of stiffness against a shift, about the centre of compliance."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._mesh: viser.MeshHandle | None = None

    def draw(self, grasp: Grasp, options: DisplayOptions, *, in_contact: bool) -> None:
        """Show the ellipsoid; see :class:`ExtraDrawing`."""
        if self._mesh is not None:
            self._mesh.remove()
            self._mesh = None
        springs = contact_set(grasp).springs if options.stiffness_ellipsoid and in_contact else None
        held = None if springs is None else stiffness_ellipsoid(springs)
        if held is None:
            return
        centre, ellipsoid = held
        shape = ellipsoid_shape(ellipsoid)
        self._mesh = self._scene.add_mesh_simple(
            f"{ROOT}/ellipsoid_stiffness",
            shape.vertices,
            shape.faces,
            position=centre,
            color=look.STIFFNESS_ELLIPSOID,
            opacity=look.ELLIPSOID_OPACITY,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )


EXTRAS: tuple[type[ExtraDrawing], ...] = (TorqueDrawing, ClearanceDrawing, WeakestPushDrawing, StiffnessDrawing)
"""All of them."""


def torque_arrows(grasp: Grasp) -> Array:
    """Return arrows along the joint axes, as long as the torques are large, in O [m], of shape (n_q, 2, 3)."""
    hand, configuration = grasp.problem.hand, grasp.configuration
    arrows = []
    for name, torque in zip(hand.joint_names, grasp.joint_torques, strict=True):
        joint = hand.model.getJointId(name)
        axis = configuration.joint_axes[hand.model.joints[joint].idx_v]
        begin = configuration.joint_poses[joint].translation
        arrows.append([begin, begin + look.TORQUE_SCALE * torque * axis])
    return np.array(arrows)
