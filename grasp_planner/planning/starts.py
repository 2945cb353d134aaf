"""Where the search starts: one fixed point in front of the object, and seeded random ones around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..problem.problem import GraspProblem
from ..spatial import Array, Pose, rotation_exp
from ..values import Value

STANDOFF = 0.05
"""How far the standard start keeps the object from the middle of the hand, along the palm normal [m]."""
ELONGATED = 1.3
"""Ratio of half extents from which an object counts as long; it is then grasped across its long axis."""


WIDE, ON_PATCHES = 0.05, 0.5
"""Middle half extent from which a hand does not close on an object as a whole [m], and the share of random starts that
then close on a pair of opposed patches, where the object has some."""
APPROACHES, ROOMIEST = 16, 4
"""Pairs, with a direction to come from, that such a start looks at, and of how many with the most room it takes one."""
PALM_AWAY = 0.08
"""How far the palm is from the point it closes on [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class GraspStart(Value):
    """A point to start from.

    Attributes:
        joint_angles: q [rad], of shape (n_q,).
        palm_pose: Pose of the palm frame P in O.
        delta_sigma: δσ [rad], of shape (n_s,).
        contact_forces: Contact forces in O where they come from springs [N], of shape (n_c, 3); None for no force.
        prepared: Whether posture and forces nearly fit already, so that phase one need not look for the geometry.
    """

    joint_angles: Array
    palm_pose: Pose
    delta_sigma: Array
    contact_forces: Array | None = None
    prepared: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "palm_pose", Pose.of(self.palm_pose))
        super().__post_init__()


def standard_start(problem: GraspProblem) -> GraspStart:
    """Return the start without contact (choice A7): the mean posture, the palm in front of the object.

    The closing axis of the hand lies along the object's longest axis, the palm normal along its shortest, and
    the object's centre is 5 cm farther along the palm normal than the middle of the hand. No internal force.

    Args:
        problem: The problem.

    Returns:
        The start.
    """
    hand, extents = problem.hand, problem.grasp_object.half_extents
    order = np.argsort(-extents, kind="stable")
    # Of equal extents the later axis is the long one, so that the paper's cylinder and a sphere start alike.
    long_axis = np.eye(3)[2 if np.isclose(extents[2], extents[order[0]]) else order[0]]
    short = [axis for axis in range(3) if long_axis[axis] == 0.0]
    approach = _from_above(problem, np.eye(3)[min(short, key=lambda axis: (extents[axis], axis))])
    rotation = _palm_rotation(problem, approach, long_axis)
    centre = problem.grasp_centre + STANDOFF * hand.palm_normal
    q = np.clip(problem.synergies.mean, hand.lower, hand.upper)
    return GraspStart(q, pin.SE3(rotation, -rotation @ centre), np.zeros(problem.n_synergies))


def random_start(problem: GraspProblem, rng: np.random.Generator) -> GraspStart:
    """Return a random start: the palm somewhere around the object, the posture along the synergies.

    On a wide object with opposed patches, as meshes have, and on one that is touched in part only, every other start
    closes on a pair of these.

    Args:
        problem: The problem.
        rng: Source of random numbers.

    Returns:
        The start.
    """
    extents = problem.grasp_object.half_extents
    points, across = problem.grasp_object.opposed_patches()
    in_part = np.median(extents) > WIDE or problem.grasp_object.grasped_in_part
    if in_part and len(points) and rng.random() < ON_PATCHES:
        chosen = rng.integers(len(points), size=APPROACHES)
        return _start_on(problem, rng, points[chosen], across[chosen])
    long_axis = np.eye(3)[int(np.argmax(extents))]
    if extents.max() < ELONGATED * np.median(extents):
        long_axis = _unit(rng.normal(size=3))
    closing = long_axis * rng.choice([-1.0, 1.0])
    approach = _from_above(problem, _unit(np.cross(closing, _unit(rng.normal(size=3)))))
    rotation = rotation_exp(rng.normal(0.0, 0.15, 3)) @ _palm_rotation(problem, approach, closing)
    centre = problem.grasp_centre + rng.normal(0.0, 0.012, 3)
    along = long_axis * rng.uniform(-0.4, 0.4) * float(extents.max() - extents.min())
    return _random_posture(problem, rng, pin.SE3(rotation, along - rotation @ centre))


def _start_on(problem: GraspProblem, rng: np.random.Generator, points: Array, across: Array) -> GraspStart:
    """Return a random start whose thumb and fingers close on both sides of one of some points, where there is room.

    Args:
        problem: The problem.
        rng: Source of random numbers.
        points: The points in O [m], of shape (n, 3).
        across: Unit directions from one side to the other, of shape (n, 3).
    """
    sideways = rng.normal(size=(len(points), 3))
    sideways -= (sideways * across).sum(axis=1, keepdims=True) * across
    approaches = _from_above(problem, sideways / np.linalg.norm(sideways, axis=1, keepdims=True))
    room = problem.grasp_object.distances(points - PALM_AWAY * np.array([[[0.5]], [[1.0]]]) * approaches).min(axis=0)
    best = int(rng.choice(np.argsort(room)[-ROOMIEST:]))
    point, approach = points[best], approaches[best]
    closing = rng.choice([-1.0, 1.0]) * np.cross(approach, across[best])
    rotation = rotation_exp(rng.normal(0.0, 0.15, 3)) @ _palm_rotation(problem, approach, closing)
    centre = problem.grasp_centre + rng.normal(0.0, 0.008, 3)
    return _random_posture(problem, rng, pin.SE3(rotation, point - rotation @ centre))


def _random_posture(problem: GraspProblem, rng: np.random.Generator, palm_pose: pin.SE3) -> GraspStart:
    """Return a start with a palm pose and a random posture along the synergies, without force."""
    hand, sigma = problem.hand, rng.normal(0.0, 0.3, problem.n_synergies)
    q = np.clip(problem.synergies.joint_angles(sigma), hand.lower, hand.upper)
    return GraspStart(q, palm_pose, np.zeros(problem.n_synergies))


def _from_above(problem: GraspProblem, approach: Array) -> Array:
    """Return directions, of shape (..., 3), turned round where they would come through a table."""
    if problem.clearance.ground is None:
        return approach
    return np.where((approach @ problem.up > 0.0)[..., None], -approach, approach)


def _palm_rotation(problem: GraspProblem, approach: Array, closing: Array) -> Array:
    """Return the rotation of P in O that takes the palm normal to a direction and the closing axis to another."""
    hand = problem.hand
    in_palm = _triad(hand.palm_normal, hand.closing_axis)
    return _triad(approach, closing) @ in_palm.T


def _triad(first: Array, second: Array) -> Array:
    """Return a right-handed orthonormal basis: the first vector, the second made normal to it, and their product."""
    second = _unit(second - (first @ second) * first)
    return np.column_stack([first, second, np.cross(first, second)])


def _unit(vector: Array) -> Array:
    """Return a vector scaled to length one."""
    return vector / np.linalg.norm(vector)
