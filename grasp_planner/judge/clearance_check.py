"""The independent check of clearances: exact distances by coal between the hand's geometry, the object and the ground.

Nothing here is shared with the search's own form in :mod:`grasp_planner.evaluation.clearance` but coal's accuracy
settings and which inner links touch with their sides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import coal
import numpy as np
import pinocchio as pin

from ..collision.coal_distances import ExactDistance
from ..collision.link_shapes import inner_axes, link_shapes
from ..hand.configuration import HandConfiguration
from ..hand.contact_frame import SKIN, ContactFrame, ContactPatch
from ..hand.hand import Hand
from ..hand.hull_fit import point_distance
from ..hand.solids import HandSolids, box_around
from ..problem.problem import GraspProblem
from ..problem.term import above_zero
from ..spatial import Array, Pose
from ..values import Value

ClearanceKind = Literal["link_object", "self_collision", "ground"]

TOLERATED = 1e-4
"""Most overlap of a touching link with the object that the error of the object's distance may excuse [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class Clearance(Value):
    """How far one solid of the hand is from another one, from the object or from the ground.

    Attributes:
        kind: What the second one is.
        link_a: Link of the first solid.
        link_b: Link of the second one, ``object`` or ``ground``.
        distance: Signed distance, negative if they overlap [m].
        point_a: Nearest point of the first one in O [m], of shape (3,).
        point_b: Nearest point of the second one in O [m], of shape (3,).
        exempt: Whether it is meant to overlap: the last link around a point fingertip and the object.
        tolerated: Overlap that is no violation [m]: where a link touches a mesh, the search sees the mesh through a
            smooth distance, and its contact may be off by that distance's error; a link that is no ball or capsule
            touches with a patch that is its surface to 0.2 mm.
    """

    kind: ClearanceKind
    link_a: str
    link_b: str
    distance: float
    point_a: Array
    point_b: Array
    exempt: bool = False
    tolerated: float = 0.0


def hand_clearances(problem: GraspProblem, q: Array, palm_in_object: Pose) -> tuple[Clearance, ...]:
    """Return the clearances of all solids from the object, from each other and from the ground if there is one.

    A point fingertip lies inside the physical one, so that its link overlaps the object by about the finger's
    radius; these pairs are marked ``exempt``.

    Args:
        problem: Hand, object, contact set and the height of the ground.
        q: Independent joint angles [rad], of shape (n_q,).
        palm_in_object: Pose of the palm frame in O.

    Returns:
        One entry for each pair of solids that is not ignored by the hand's description.
    """
    return configuration_clearances(problem, HandConfiguration(problem.hand, q, palm_in_object))


def configuration_clearances(
    problem: GraspProblem, configuration: HandConfiguration, *, near: float = math.inf
) -> tuple[Clearance, ...]:
    """Return :func:`hand_clearances` of the problem's hand in O.

    Args:
        problem: Hand, object, contact set and the height of the ground.
        configuration: The hand in O.
        near: Pairs farther apart than this are left out [m]: with 0 those that do not overlap.
    """
    placed = _PlacedSolids(problem.hand.solids, configuration.geometry_placements(), near)
    found = [*_from_object(problem, placed), *_from_each_other(placed)]
    return tuple(found if problem.clearance.ground is None else [*found, *_from_ground(problem, placed)])


class _PlacedSolids:
    """The solids of a hand in O, and what coal says of their distances up to a limit."""

    def __init__(self, solids: HandSolids, placements: Sequence[pin.SE3], near: float) -> None:
        self.solids, self.near = solids, near
        self.centres = solids.ball_centres(placements)
        self._exact, self._placements = ExactDistance(), placements
        self._poses: dict[int, Any] = {}

    def pose(self, row: int) -> Any:
        """Return the pose of a solid, as coal takes it."""
        if row not in self._poses:
            placement = self._placements[row]
            self._poses[row] = coal.Transform3s(placement.rotation, placement.translation)
        return self._poses[row]

    def nearest(self, row: int, other: Any, pose: Any) -> tuple[float, Array, Array] | None:
        """Return the distance from another solid at a pose, and the nearest points [m]; None beyond the limit."""
        value, points_a, points_b = self._exact.nearest(self.solids.geometries[row], self.pose(row), other, pose)
        return None if value > self.near else (value, points_a, points_b)


def _from_object(problem: GraspProblem, placed: _PlacedSolids) -> Iterator[Clearance]:
    """Yield the clearances from the object of the solids the balls of which are near the box around it."""
    solids, solid, identity = placed.solids, problem.grasp_object.solid, coal.Transform3s()
    exempt_joints = {frame.joint_id for frame in problem.frames if frame.radius == 0.0}
    touching_joints = {frame.joint_id for frame in problem.frames}
    skin_joints = {frame.joint_id for frame in problem.frames if frame.patch is not None}
    mesh_error = min(solid.distance_error, TOLERATED)
    geometry = solid.coal_geometry()
    low, high = box_around(geometry)
    outside = np.maximum(np.maximum(low - placed.centres, placed.centres - high), 0.0)
    apart = np.linalg.norm(outside, axis=1) - solids.radii
    for row in np.flatnonzero(~(apart > placed.near)).tolist():
        if (found := placed.nearest(row, geometry, identity)) is None:
            continue
        link, joint = solids.links[row], solids.joints[row]
        tolerated = (mesh_error if joint in touching_joints else 0.0) + (SKIN if joint in skin_joints else 0.0)
        yield Clearance("link_object", link, "object", *found, joint in exempt_joints, tolerated)


def _from_each_other(placed: _PlacedSolids) -> Iterator[Clearance]:
    """Yield the clearances between solids the balls of which are near each other."""
    solids, centres, radii = placed.solids, placed.centres, placed.solids.radii
    apart = np.linalg.norm(centres[:, None] - centres, axis=2) - radii[:, None] - radii
    for j, i in np.argwhere((solids.checked & ~(apart > placed.near)).T).tolist():
        if (found := placed.nearest(i, solids.geometries[j], placed.pose(j))) is not None:
            yield Clearance("self_collision", solids.links[i], solids.links[j], *found)


def _from_ground(problem: GraspProblem, placed: _PlacedSolids) -> Iterator[Clearance]:
    """Yield the clearances from the ground of the solids the balls of which are near it."""
    level, identity = problem.clearance.ground, coal.Transform3s()
    assert level is not None
    ground = coal.Halfspace(np.array(problem.up), float(level))
    apart = placed.centres @ problem.up - level - placed.solids.radii
    for row in np.flatnonzero(~(apart > placed.near)).tolist():
        if (found := placed.nearest(row, ground, identity)) is not None:
            yield Clearance("ground", placed.solids.links[row], "ground", *found)


def least_distance(clearances: tuple[Clearance, ...], kind: ClearanceKind) -> Clearance | None:
    """Return the closest pair of a kind that is not exempt; None if there is none."""
    return min(_counted(clearances, kind), key=lambda pair: pair.distance, default=None)


def penetration(clearances: tuple[Clearance, ...], kind: ClearanceKind, tolerant: bool = False) -> float:
    """Return the deepest overlap of a kind [m], beyond what is tolerated if so asked; 0 if there is none."""
    overlaps = [-pair.distance - tolerant * pair.tolerated for pair in _counted(clearances, kind)]
    return above_zero(np.max(overlaps, initial=0.0))


def joint_centre_depth(problem: GraspProblem, configuration: HandConfiguration) -> float:
    """Return how deep the deepest joint centre lies inside the object [m]; 0 if none does; Remark 2."""
    return above_zero(-problem.grasp_object.solid.sample(configuration.joint_centres).distance.min())


def tip_overhang(problem: GraspProblem, configuration: HandConfiguration, normals: Array) -> float:
    """Return the largest −n·a of the touching last links, 0 if none leans beyond the object's tangent plane.

    Of a contact with a patch it is the largest sine of the angle by which the normal is beyond the patch.

    Args:
        problem: Hand and contact set.
        configuration: The hand in O.
        normals: Contact normals into the object, in O, of shape (n_c, 3).

    Returns:
        The overhang, dimensionless.
    """
    axes = configuration.last_link_vectors(problem.frames)
    inner, worst = problem.hand.model.parents.tolist()[1:], 0.0
    for frame, axis, normal in zip(problem.frames, axes, normals, strict=True):
        length = float(np.linalg.norm(axis))
        if frame.patch is not None:
            inside = configuration.joint_poses[frame.joint_id].rotation.T @ normal
            worst = np.maximum(worst, _beyond(frame.patch, inside))
        elif frame.joint_id not in inner and length > 1e-6:
            worst = np.maximum(worst, -float(normal @ axis) / length)
    return float(worst)


def contact_off_link(problem: GraspProblem, configuration: HandConfiguration, normals: Array) -> float:
    """Return how far the farthest contact lies in the air off the exact geometry of its link, beyond the skin [m].

    A contact is where its ball, or patch, touches: a radius from its centre along the normal. Point fingertips lie
    inside their links and do not count; inside of a solid a contact is not in the air.

    Args:
        problem: Hand and contact set.
        configuration: The hand in O.
        normals: Contact normals into the object, in O, of shape (n_c, 3).
    """
    centres, poses, worst = configuration.contact_centres(problem.frames), configuration.joint_poses, 0.0
    for frame, centre, normal in zip(problem.frames, centres, normals, strict=True):
        solids = touching_solids(problem.hand, frame)
        if not solids:
            continue
        pose = poses[frame.joint_id]
        touch = pose.rotation.T @ (centre + frame.radius * normal - pose.translation)
        least = math.inf
        for entry in solids:
            least = np.minimum(least, _gap(entry.geometry, np.array(entry.placement.actInv(touch))))
            if least <= SKIN:
                break
        worst = np.maximum(worst, least - SKIN)
    return above_zero(worst)


def touching_solids(hand: Hand, frame: ContactFrame) -> list[Any]:
    """Return the collision geometries of the link that a contact with a radius belongs to; none of a point's."""
    entries, joints = hand.collision_model.geometryObjects, hand.solids.joints
    return [entries[row] for row, joint in enumerate(joints) if joint == frame.joint_id and frame.radius > 0.0]


def _gap(geometry: Any, point: Array) -> float:
    """Return the distance of a point in the frame of a geometry from it [m]; NaN if it is not a number."""
    return point_distance(geometry, point) if np.isfinite(point).all() else float("nan")


def _beyond(patch: ContactPatch, normal: Array) -> float:
    """Return by how much a normal in the frame of the joint is beyond a patch, about the sine of the angle."""
    middle, across = np.array(patch.normal), np.array(patch.across)
    aside = float(normal @ across)
    bent = float(np.arctan2(normal @ np.cross(across, middle), normal @ middle))
    over = np.sin(min(abs(bent) - patch.bend, np.pi / 2))
    return float(max(0.0, abs(aside) - np.sin(patch.side), over))


def side_tilt(problem: GraspProblem, configuration: HandConfiguration, normals: Array) -> float:
    """Return the largest |n·a| of the inner links that touch with their sides; 0 if none does.

    Args:
        problem: Hand and contact set.
        configuration: The hand in O.
        normals: Contact normals into the object, in O, of shape (n_c, 3).

    Returns:
        The tilt out of the object's tangent plane, dimensionless.
    """
    hand = problem.hand
    poses = configuration.joint_poses
    sides = inner_axes(hand, link_shapes(hand), problem.frames)
    tilts = [abs(float(normals[i] @ (poses[joint].rotation @ axis))) for i, joint, axis in sides]
    return float(np.max(tilts, initial=0.0))


def _counted(clearances: tuple[Clearance, ...], kind: ClearanceKind) -> Iterator[Clearance]:
    """Yield the pairs of a kind that are not meant to overlap."""
    return (pair for pair in clearances if pair.kind == kind and not pair.exempt)
