"""What is to be seen of a grasp in pictures: meshes with colours, labels with numbers, a legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..model.task import transmission_ellipsoid
from ..model.task_direction import TaskDirection
from ..objects import GraspObject
from ..spatial import Array, Pose, rotation_between
from . import look
from .look import Colour
from .meshes import link_meshes, link_placements, object_mesh
from .shapes import cone_mesh, ellipsoid_shape
from .view import DrawnMesh, View, fitted

FIELD_OF_VIEW = 0.5
"""Vertical angle of view of pictures [rad]."""
SHAFT, TASK_SHAFT = 0.0019, 0.0026
"""Radii of the shafts of force and task arrows [m]."""
HEAD_WIDTH, HEAD_LENGTH, LONGEST_HEAD = 2.5, 6.0, 0.4
"""Radius and length of an arrow's head by the radius of its shaft, and the largest share of the arrow it takes."""
FLOOR_BELOW = 0.004
"""How far the floor is below everything [m]."""
OVERLAP = 1e-5
"""Links deeper than this inside something are red [m]."""


@dataclass(frozen=True)
class Label:
    """Words at a place.

    Attributes:
        place: Where, in O [m].
        text: The words.
        colour: Their colour.
    """

    place: Array
    text: str
    colour: Colour


@dataclass(frozen=True)
class GraspScene:
    """A grasp as it is drawn, in O.

    Attributes:
        solids: The meshes.
        labels: Numbers beside them.
        legend: What each colour means.
    """

    solids: tuple[DrawnMesh, ...]
    labels: tuple[Label, ...]
    legend: tuple[tuple[Colour, str], ...]


def grasp_scene(grasp: Grasp, *, held: bool = True) -> GraspScene:
    """Return a grasp as it is drawn.

    Args:
        grasp: The grasp.
        held: Whether to draw forces, cones, task and ellipsoid; if not, only hand and object.

    Returns:
        Meshes, labels and legend.
    """
    problem = grasp.problem
    deep = [entry for entry in grasp.clearances if entry.distance < -OVERLAP and not entry.exempt]
    inside = dict.fromkeys((link for entry in deep for link in (entry.link_a, entry.link_b)), look.PENETRATING)
    solids = hand_solids(problem.hand, grasp.joint_angles, grasp.palm_pose, special=inside)
    solids.append(object_solid(problem.grasp_object))
    legend: list[tuple[Colour, str]] = [(look.OBJECT, problem.grasp_object.kind)]
    if inside:
        legend.append((look.PENETRATING, "links that overlap"))
    labels: list[Label] = []
    if held:
        more, labels, words = _forces(grasp)
        solids += [*more, *_tasks(problem.tasks)]
        legend += [*words, (look.TASK, f"task {', '.join(task.text for task in problem.tasks)}")]
        shape = ellipsoid_shape(transmission_ellipsoid(grasp.object_synergy_map, "force"))
        if len(shape.faces):
            mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
            solids.append(DrawnMesh(mesh, look.FORCE_ELLIPSOID, look.ELLIPSOID_OPACITY))
            legend.append((look.FORCE_ELLIPSOID, f"force ellipsoid ({shape.note})"))
    return GraspScene((*solids, floor_of(solids)), tuple(labels), tuple(legend))


def object_solid(grasp_object: GraspObject) -> DrawnMesh:
    """Return an object as it is drawn."""
    body = object_mesh(grasp_object)
    return DrawnMesh(body, look.OBJECT, look.PRINTED_OPACITY, smooth=_is_curved(body))


def hand_solids(
    hand: Hand,
    q: Array,
    palm_in_object: Pose,
    *,
    special: dict[str, Colour] | None = None,
    colour: Colour | None = None,
    opacity: float = 1.0,
) -> list[DrawnMesh]:
    """Return the links of a hand.

    Args:
        hand: The hand.
        q: Independent joint angles [rad], of shape (n_q,).
        palm_in_object: Pose of the palm frame in O.
        special: Colours of some links, by name.
        colour: Colour of all other links; palm, links and fingertips have theirs if left out.
        opacity: From 0 to 1.
    """
    placements = link_placements(hand, q, palm_in_object)
    tips = {frame.joint_id for frame in hand.contact_frames(None)}
    found = []
    for entry in link_meshes(hand):
        mesh = entry.mesh.copy()
        mesh.apply_transform(placements[entry.geometry_id].homogeneous)
        joint = hand.collision_model.geometryObjects[entry.geometry_id].parentJoint
        usual = look.PALM if entry.link == hand.description.palm.link else look.PAD if joint in tips else look.HAND
        found.append(DrawnMesh(mesh, (special or {}).get(entry.link, colour or usual), opacity))
    return found


def arrow(begin: Array, end: Array, radius: float, colour: Colour) -> DrawnMesh | None:
    """Return an arrow; None if it has no length."""
    way = end - begin
    length = float(np.linalg.norm(way))
    if length < 1e-6:
        return None
    head = min(HEAD_LENGTH * radius, LONGEST_HEAD * length)
    shaft = trimesh.creation.cylinder(radius=radius, height=length - head, sections=20)
    shaft.apply_translation([0.0, 0.0, (length - head) / 2.0])
    tip = trimesh.creation.cone(radius=HEAD_WIDTH * radius, height=head, sections=24)
    tip.apply_translation([0.0, 0.0, length - head])
    whole = trimesh.util.concatenate([shaft, tip])
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = rotation_between(np.array([0.0, 0.0, 1.0]), way / length), begin
    whole.apply_transform(turn)
    return DrawnMesh(whole, colour)


def floor_of(solids: Sequence[DrawnMesh]) -> DrawnMesh:
    """Return a floor below solids, which shows their shadow only."""
    bounds = np.array([solid.mesh.bounds for solid in solids])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    half, height = (high - low).max(), low[2] - FLOOR_BELOW
    square = half * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    square += np.array([*((low + high) / 2.0)[:2], height])
    mesh = trimesh.Trimesh(square, [[0, 1, 2], [0, 2, 3]], process=False)
    return DrawnMesh(mesh, (255, 255, 255), smooth=False, floor=True)


def framed(solids: Sequence[DrawnMesh], direction: Array, width: int, height: int) -> View:
    """Return a view along which all solids but the floor fill the picture and nothing is cut off.

    Args:
        solids: What is to be seen.
        direction: From what is seen towards the eye.
        width: Of the picture [pixels].
        height: Of the picture [pixels].
    """
    points = np.concatenate([np.asarray(solid.mesh.vertices) for solid in solids if not solid.floor])
    eye, target = fitted(points, direction, FIELD_OF_VIEW, width / height)
    return View(eye, target, FIELD_OF_VIEW, width, height)


def _forces(grasp: Grasp) -> tuple[list[DrawnMesh], list[Label], list[tuple[Colour, str]]]:
    """Return contact forces with newtons, friction cones and the weight."""
    points, normals, forces = grasp.contacts.points, grasp.contacts.normals, grasp.forces
    largest = float(np.linalg.norm(forces, axis=1).max())
    scale = 1e-3 * look.GOOD_ARROW_MM / max(largest, 1e-6)
    solids, labels = [], []
    vertices, faces = cone_mesh(1.0, look.CONE_LENGTH)
    friction = grasp.problem.friction if grasp.problem.contact_model.has_friction else np.zeros(len(points))
    for i, (point, normal, force) in enumerate(zip(points, normals, forces, strict=True)):
        drawn = arrow(point, point + scale * force, SHAFT, look.FORCE)
        if drawn is not None:
            solids.append(drawn)
            newtons = f"{grasp.problem.frames[i].name} {np.linalg.norm(force):.1f} N"
            labels.append(Label(point + 0.5 * scale * force, newtons, look.FORCE))
        width = float(np.clip(friction[i], 0.01, 3.0))
        turned = (vertices * [width, width, 1.0]) @ rotation_between(np.array([0.0, 0.0, 1.0]), normal).T + point
        inside = grasp.friction_margins[i] >= -1e-6
        cone = trimesh.Trimesh(turned, faces, process=False)
        solids.append(DrawnMesh(cone, look.CONE_GOOD if inside else look.CONE_BAD, look.CONE_OPACITY))
    weight = grasp.problem.external_wrench[:3]
    drawn = arrow(np.zeros(3), scale * weight, SHAFT, look.WEIGHT)
    words: list[tuple[Colour, str]] = [(look.FORCE, "contact forces"), (look.CONE_GOOD, "friction cones")]
    if drawn is not None:
        solids.append(drawn)
        words.append((look.WEIGHT, f"load {np.linalg.norm(weight):.1f} N"))
    return solids, labels, words


def _tasks(tasks: Sequence[TaskDirection]) -> list[DrawnMesh]:
    """Return the arrows of the task directions."""
    found = []
    for task in tasks:
        part = task.direction[3:] if task.kind == "torque" or not task.direction[:3].any() else task.direction[:3]
        drawn = arrow(np.zeros(3), look.TASK_LENGTH * part / np.linalg.norm(part), TASK_SHAFT, look.TASK)
        found += [drawn] if drawn is not None else []
    return found


def _is_curved(mesh: trimesh.Trimesh) -> bool:
    """Return whether most edges of a mesh are blunt, so that it is to be shaded smoothly."""
    angles = mesh.face_adjacency_angles
    return bool(len(angles)) and float(np.mean(angles < np.radians(35.0))) > 0.9
