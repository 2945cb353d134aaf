"""Object, contacts, cones, forces, task and ellipsoids in the scene, all in the frame O of the object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
import trimesh
import viser

from ...drawing import look
from ...drawing.meshes import object_mesh
from ...drawing.shapes import Faces, cone_mesh, ellipsoid_shape
from ...exceptions import GraspPlannerError
from ...grasp.grasp import Grasp
from ...model.task import transmission_ellipsoid
from ...problem.problem import GraspProblem
from ...spatial import Array, Pose, rotation_between
from ..live import contact_share
from ..push import PushedGrasp
from .colours import instance_colours
from .draw_hand import place

ROOT = "/object"


@dataclass
class DisplayOptions:
    """What is shown; the attributes are the check boxes and sliders of the page.

    Attributes:
        force_scale: Length of force arrows [mm/N].
    """

    object: bool = True
    contacts: bool = True
    normals: bool = False
    cones: bool = True
    forces: bool = True
    weight: bool = True
    task: bool = True
    force_ellipsoid: bool = True
    torque_ellipsoid: bool = False
    velocity_ellipsoid: bool = False
    stiffness_ellipsoid: bool = False
    reference_ghost: bool = False
    seed_ghost: bool = False
    pinned_ghost: bool = True
    torques: bool = False
    clearances: bool = True
    margin: bool = False
    springs: bool = False
    labels: bool = False
    force_scale: float = look.FORCE_SCALE_MM


class GraspDrawing:
    """The object of one problem with everything that shows how it is held.

    Attributes:
        object_handle: The object's mesh.
        contact_handle: The dots of all contacts.
        task_handle: The ball at the tip of the task arrow.
        notes: What the ellipsoids shown are, in words.
    """

    def __init__(self, scene: viser.SceneApi, problem: GraspProblem) -> None:
        self.problem = problem
        self.notes: list[str] = []
        self._marked = -1
        self._scene = scene
        self._root = scene.add_frame(ROOT, show_axes=False)
        self._ellipsoids: dict[str, Any] = {}
        mesh = object_mesh(problem.grasp_object)
        self.object_handle = scene.add_mesh_simple(
            f"{ROOT}/mesh",
            np.array(mesh.vertices),
            np.array(mesh.faces),
            color=look.OBJECT,
            opacity=look.OBJECT_OPACITY,
            side="back",
            flat_shading=problem.grasp_object.kind == "box",
        )
        self._add_contacts()
        self._add_arrows()
        self.task_handle = scene.add_icosphere(f"{ROOT}/task_ball", radius=0.006, color=look.TASK)

    def remove(self) -> None:
        """Take it out of the scene."""
        self._root.remove()

    def move(self, pose: Pose) -> None:
        """Put the object with all that belongs to it at a pose in the world."""
        place(self._root, pose)

    def draw(self, grasp: Grasp, options: DisplayOptions, pushed: PushedGrasp | None = None) -> None:
        """Show a grasp of this problem's object and contacts.

        Args:
            grasp: The grasp.
            options: What to show.
            pushed: How it answers to a push that is tried.
        """
        self.object_handle.visible = options.object
        points, normals = grasp.contacts.points, grasp.contacts.normals
        self.contact_handle.batched_positions = np.asarray(points, dtype=np.float32)
        self.contact_handle.visible = options.contacts
        self._normals.visible = options.normals
        if options.normals:
            self._normals.points = _segments(points - look.NORMAL_LENGTH * normals, points)
        share = contact_share(grasp)
        forces = self._forces_of(grasp) * share if pushed is None else pushed.forces
        colours = np.tile(look.FORCE, (len(forces), 1)) if pushed is None else pushed.colours
        self._forces.colors = instance_colours(colours)
        self._draw_forces(grasp, forces, options, touching=share > 0.0)
        self._draw_task(grasp, options)
        self._draw_ellipsoids(grasp, options)
        for label, point, normal in zip(self._labels, points, normals, strict=True):
            label.visible = options.labels
            if options.labels:
                label.position = point - 0.012 * normal

    def mark(self, contact: int) -> None:
        """Show one contact in the colour of what is selected, by its index; none if negative."""
        if contact != self._marked:
            self._marked = contact
            colours = np.tile(look.CONTACT, (len(self.problem.frames), 1))
            if 0 <= contact < len(colours):
                colours[contact] = look.SELECTED
            self.contact_handle.batched_colors = instance_colours(colours)

    def _add_contacts(self) -> None:
        """Add dots, labels and friction cones; names count the copies, of which a node that is drawn can't get more."""
        n_c = len(self.problem.frames)
        still, turned = np.zeros((n_c, 3), np.float32), np.tile([1.0, 0.0, 0.0, 0.0], (n_c, 1)).astype(np.float32)
        ball = trimesh.creation.icosphere(subdivisions=2, radius=look.CONTACT_RADIUS)
        self.contact_handle = self._scene.add_batched_meshes_simple(
            f"{ROOT}/contacts_{n_c}",
            np.array(ball.vertices),
            np.array(ball.faces),
            turned,
            still,
            batched_colors=instance_colours(np.tile(look.CONTACT, (n_c, 1))),
            cast_shadow=False,
        )
        friction = self.problem.friction if self.problem.contact_model.has_friction else np.zeros(n_c)
        vertices, faces = cone_mesh(1.0, look.CONE_LENGTH)
        width = np.clip(friction, 0.01, 3.0)
        self._cones = self._scene.add_batched_meshes_simple(
            f"{ROOT}/cones_{n_c}",
            vertices,
            faces,
            turned,
            still,
            batched_scales=np.column_stack([width, width, np.ones(n_c)]).astype(np.float32),
            batched_colors=instance_colours(np.tile(look.CONE_GOOD, (n_c, 1))),
            opacity=look.CONE_OPACITY,
            side="double",
            cast_shadow=False,
        )
        self._labels = [
            self._scene.add_label(
                f"{ROOT}/label_{index}", frame.name, visible=False, font_screen_scale=0.8, anchor="bottom-center"
            )
            for index, frame in enumerate(self.problem.frames)
        ]

    def _add_arrows(self) -> None:
        """Add the arrows of normals, forces, weight and task."""
        n_c = len(self.problem.frames)

        def arrows(name: str, colour: look.Colour, thickness: float, number: int = 1) -> viser.ArrowsHandle:
            return self._scene.add_arrows(
                f"{ROOT}/{name}_{number}",
                np.zeros((number, 2, 3), np.float32),
                instance_colours(colour),
                shaft_radius=thickness,
                head_radius=2.4 * thickness,
                head_length=5.0 * thickness,
            )

        # As many as contacts from the start: a page may draw between the arrival of colours and that of points.
        self._normals = arrows("normals", look.NORMAL, 0.0006, n_c)
        self._forces = arrows("forces", look.FORCE, 0.0016, n_c)
        self._weight = arrows("weight", look.WEIGHT, 0.0014)
        self._tasks = arrows("tasks", look.TASK, 0.0024)

    def _forces_of(self, grasp: Grasp) -> Array:
        """Return the contact forces [N], or zeros where the contacts determine none."""
        try:
            return grasp.forces
        except (GraspPlannerError, np.linalg.LinAlgError):
            return np.zeros_like(grasp.contacts.points)

    def _draw_forces(self, grasp: Grasp, forces: Array, options: DisplayOptions, *, touching: bool) -> None:
        """Show cones, contact forces and the weight."""
        points, normals = grasp.contacts.points, grasp.contacts.normals
        turns = [rotation_between(np.array([0.0, 0.0, 1.0]), normal) for normal in normals]
        self._cones.batched_positions = np.asarray(points, dtype=np.float32)
        self._cones.batched_wxyzs = np.array([_wxyz(turn) for turn in turns], dtype=np.float32)
        if touching:
            good = grasp.friction_margins >= -1e-6
            self._cones.batched_colors = instance_colours(np.where(good[:, None], look.CONE_GOOD, look.CONE_BAD))
        self._cones.visible = options.cones and touching
        self._forces.points = _segments(points, points + _arrow(forces, options.force_scale))
        self._forces.visible = options.forces and touching
        weight = grasp.problem.external_wrench[None, :3]
        self._weight.points = _segments(np.zeros((1, 3)), _arrow(weight, options.force_scale))
        self._weight.visible = options.weight

    def _draw_task(self, grasp: Grasp, options: DisplayOptions) -> None:
        """Show the task directions and the ball to drag the first one with."""
        parts = [_task_part(task) for task in grasp.problem.tasks]
        tips = np.array([look.TASK_LENGTH * part for part in parts])
        self._tasks.points = _segments(np.zeros_like(tips), tips)
        self._tasks.visible = self.task_handle.visible = options.task
        self.task_handle.position = tips[0] * 1.04

    def _draw_ellipsoids(self, grasp: Grasp, options: DisplayOptions) -> None:
        """Show the ellipsoids that are asked for, and say what they are."""
        self.notes = []
        wanted = (
            ("force", options.force_ellipsoid, look.FORCE_ELLIPSOID),
            ("torque", options.torque_ellipsoid, look.TORQUE),
            ("twist", options.velocity_ellipsoid, look.VELOCITY_ELLIPSOID),
        )
        for kind, shown, colour in wanted:
            title = "velocity" if kind == "twist" else kind
            if not shown:
                self._hide(kind)
                continue
            try:
                ellipsoid = transmission_ellipsoid(grasp.object_synergy_map, kind)  # type: ignore[arg-type]
            except (GraspPlannerError, np.linalg.LinAlgError):
                self._hide(kind)
                self.notes.append(f"{title} ellipsoid: does not exist here (H_s has a rank below 6)")
                continue
            shape = ellipsoid_shape(ellipsoid)
            self.notes.append(f"{title} ellipsoid: {shape.note}")
            self._show(kind, shape.vertices, shape.faces, colour)

    def _hide(self, kind: str) -> None:
        """Hide an ellipsoid."""
        if kind in self._ellipsoids:
            self._ellipsoids[kind].visible = False

    def _show(self, kind: str, vertices: Array, faces: Faces, colour: look.Colour) -> None:
        """Show an ellipsoid; its mesh is replaced only if the number of triangles has changed."""
        if not len(faces):
            self._hide(kind)
            return
        handle = self._ellipsoids.get(kind)
        if handle is not None and handle.vertices.shape == vertices.shape and np.array_equal(handle.faces, faces):
            handle.vertices = vertices.astype(np.float32)
            handle.visible = True
            return
        self._ellipsoids[kind] = self._scene.add_mesh_simple(
            f"{ROOT}/ellipsoid_{kind}",
            vertices,
            faces,
            color=colour,
            opacity=look.ELLIPSOID_OPACITY,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )


def fitting_scale(grasp: Grasp) -> float:
    """Return the scale at which the largest contact force of a grasp is drawn well [mm/N]."""
    largest = float(np.linalg.norm(grasp.forces, axis=1).max())
    return float(np.clip(round(look.GOOD_ARROW_MM / max(largest, 1e-3)), 5.0, 150.0))


def _segments(begin: Array, end: Array) -> Array:
    """Return arrows from begin to end, of shape (n, 2, 3)."""
    return np.stack([begin, end], axis=1).astype(np.float32)


def _arrow(forces: Array, scale_mm: float) -> Array:
    """Return forces as drawn lengths [m], none longer than the picture bears."""
    arrows = forces * (scale_mm * 1e-3)
    length = np.maximum(np.linalg.norm(arrows, axis=1, keepdims=True), 1e-12)
    return arrows * np.minimum(1.0, look.LONGEST_ARROW / length)


def _task_part(task: Any) -> Array:
    """Return the unit direction of a task that is drawn: the linear part, or the angular one."""
    linear, angular = task.direction[:3], task.direction[3:]
    part = angular if task.kind == "torque" or not linear.any() else linear
    return part / max(float(np.linalg.norm(part)), 1e-12)


def _wxyz(rotation: Array) -> Array:
    """Return a rotation as a quaternion (w, x, y, z)."""
    x, y, z, w = pin.Quaternion(rotation).coeffs()
    return np.array([w, x, y, z])
