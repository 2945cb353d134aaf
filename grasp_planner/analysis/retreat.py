"""Validity of a plan: can the hand open and be pulled straight back along its palm normal without collision?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..checks import positive
from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..hand.configuration import HandConfiguration
from ..judge.clearance_check import Clearance, hand_clearances
from ..model.contacts import find_contacts
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose

OPENING_STEPS = 24
"""Steps in which the hand opens."""
OPENING_DAMPING = 1e-2
"""Damping of the synergy velocities that open the hand, relative to their gain."""
TOUCH = 1e-4
"""Overlap that counts as touching only [m]."""

Opening = Literal["synergies", "joints"]


@dataclass(frozen=True)
class RetreatReport:
    """What happens when the hand lets go and is pulled back; the approach is the same path the other way round.

    Attributes:
        free: Whether the whole retreat is free of collision.
        distance: How far the palm gets along its normal before the first collision; if free, the distance after
            which every link is farther from the object than ``clear`` [m].
        opening: Whether the fingers open along the synergies of the problem, or joint by joint.
        opened: Least gap of the fingertips once the hand is open [m].
        collision: The first pair that collides; None if free.
        palm_poses: Palm poses in O along the path, the grasp's first.
        joint_angles: Postures along the path [rad], of shape (n, n_q).
    """

    free: bool
    distance: float
    opening: Opening
    opened: float
    collision: Clearance | None
    palm_poses: tuple[Pose, ...]
    joint_angles: Array


def retreat_distance(
    grasp: Grasp,
    *,
    opening: float = 0.015,
    step: float = 0.005,
    clear: float = 0.02,
    reach: float = 0.4,
) -> RetreatReport:
    """Check the straight retreat of a grasp: open the hand on the spot, then pull the palm back along its normal.

    The fingers open along the synergies of the problem; if that way is blocked, joint by joint.

    Args:
        grasp: The grasp.
        opening: Gap the fingertips are opened to, if joint limits allow [m].
        step: Distance between the checked palm poses [m].
        clear: Distance of all links from the object at which the hand counts as away [m].
        reach: Longest retreat [m].

    Returns:
        What happens on the way.

    Raises:
        InvalidValueError: If a length is not positive, or the step is longer than the reach.
    """
    for name, value in {"opening": opening, "step": step, "clear": clear, "reach": reach}.items():
        positive(name, value, unit="m")
    if step > reach:
        raise InvalidValueError("step", step, f"at most the reach of {reach} m")
    by_synergies = _retreat(grasp, "synergies", opening, step, clear, reach)
    if by_synergies.free:
        return by_synergies
    by_joints = _retreat(grasp, "joints", opening, step, clear, reach)
    return by_joints if by_joints.free else by_synergies


def _retreat(grasp: Grasp, mode: Opening, opening: float, step: float, clear: float, reach: float) -> RetreatReport:
    """Check the retreat with one way to open the hand."""
    problem, pose = grasp.problem, grasp.palm_pose
    postures = _opening_path(grasp, mode, opening)
    poses = [pose] * len(postures)
    opened = float(_gaps(problem, postures[-1], pose).min())

    def report(distance: float, collision: Clearance | None) -> RetreatReport:
        return RetreatReport(
            free=collision is None,
            distance=distance,
            opening=mode,
            opened=opened,
            collision=collision,
            palm_poses=tuple(poses),
            joint_angles=np.array(postures[: len(poses)]),
        )

    tolerated = _overlapping(hand_clearances(problem, grasp.joint_angles, pose))
    for count, q in enumerate(postures[1:], start=2):
        hit = _first_collision(hand_clearances(problem, q, pose), tolerated, exempt=True)
        if hit is not None:
            del poses[count:]
            return report(0.0, hit)
    back = -np.array(pose.rotation) @ problem.hand.palm_normal
    for distance in np.arange(step, reach + 0.5 * step, step):
        moved = Pose(pose.rotation, pose.translation + distance * back)
        found = hand_clearances(problem, postures[-1], moved)
        poses.append(moved)
        postures.append(postures[-1])
        hit = _first_collision(found, tolerated, exempt=False)
        if hit is not None:
            return report(float(distance - step), hit)
        if min(pair.distance for pair in found if pair.kind == "link_object") > clear:
            return report(float(distance), None)
    return report(float(reach), None)


def _opening_path(grasp: Grasp, mode: Opening, opening: float) -> list[Array]:
    """Return postures from the grasp to the open hand: least-squares velocities that move all tips off the surface."""
    problem, pose, hand = grasp.problem, grasp.palm_pose, grasp.problem.hand
    basis = problem.synergies.basis if mode == "synergies" else np.eye(hand.n_joints)
    q, path = np.array(grasp.joint_angles), [np.array(grasp.joint_angles)]
    for _ in range(OPENING_STEPS):
        configuration = HandConfiguration(hand, q, pose)
        centres = configuration.contact_centres(problem.frames)
        contacts = find_contacts(centres, problem.radii, problem.grasp_object)
        if contacts.gaps.min() >= opening:
            break
        jacobian = configuration.contact_jacobian(problem.frames, contacts.points)
        away = -np.einsum("ij,ijk->ik", contacts.normals, jacobian.reshape(-1, 3, hand.n_joints)) @ basis
        wanted = np.clip(opening - contacts.gaps, 0.0, 2.0 * opening / OPENING_STEPS)
        damping = OPENING_DAMPING * float(np.trace(away @ away.T)) / len(away)
        move = away.T @ np.linalg.solve(away @ away.T + damping * np.eye(len(away)), wanted)
        q = np.clip(q + basis @ move, hand.lower, hand.upper)
        path.append(q)
    return path


def _gaps(problem: GraspProblem, q: Array, pose: Pose) -> Array:
    """Return the gaps of the fingertips [m]."""
    centres = HandConfiguration(problem.hand, q, pose).contact_centres(problem.frames)
    return find_contacts(centres, problem.radii, problem.grasp_object).gaps


def _overlapping(clearances: tuple[Clearance, ...]) -> dict[tuple[str, str], float]:
    """Return how deep pairs overlap in the grasp itself [m]; on the way they must not get deeper."""
    depth: dict[tuple[str, str], float] = {}
    for pair in clearances:
        key = (pair.link_a, pair.link_b)
        depth[key] = max(depth.get(key, 0.0), -pair.distance)
    return depth


def _first_collision(
    clearances: tuple[Clearance, ...], tolerated: dict[tuple[str, str], float], *, exempt: bool
) -> Clearance | None:
    """Return the pair that overlaps most beyond what is tolerated; None if there is none."""
    worst: Clearance | None = None
    for pair in clearances:
        if exempt and pair.exempt:
            continue
        allowed = TOUCH if pair.exempt else TOUCH + tolerated.get((pair.link_a, pair.link_b), 0.0)
        if pair.distance < -allowed and (worst is None or pair.distance < worst.distance):
            worst = pair
    return worst
