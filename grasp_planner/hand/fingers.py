"""Which chains of joints are fingers: links without geometry and knuckles that another finger covers are none."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import coal
import numpy as np

from ..exceptions import shown
from ..spatial import Array
from .geometry_mesh import link_points
from .motion import HandMotion

COVERED = 0.008
"""Distance from another finger up to which the end of a driven link counts as covered by it [m]."""


@dataclass(frozen=True, eq=False)
class Finger:
    """A chain of joints that ends in a link which can touch something.

    Attributes:
        joint: Last moving joint, an index of the model.
        chain: Moving joints from the root to it.
        geometries: Collision geometries that the last joint carries.
        points: Points of their surface in the frame of the joint [m], of shape (n, 3); its origin if there are none.
    """

    joint: int
    chain: tuple[int, ...]
    geometries: tuple[Any, ...]
    points: Array

    @cached_property
    def end(self) -> Array:
        """The point of its last link that is farthest from the joint [m], of shape (3,)."""
        return self.points[int(np.argmax((self.points**2).sum(axis=1).round(9)))]


def find_fingers(motion: HandMotion) -> tuple[tuple[Finger, ...], tuple[str, ...]]:
    """Return the fingers of a URDF and a line for each chain that is none.

    Args:
        motion: Its joints.

    Returns:
        The fingers in the order of the model, and what was left out.
    """
    model, said = motion.model, []
    carried: dict[int, list[Any]] = {}
    for entry in motion.collision_model.geometryObjects:
        carried.setdefault(int(entry.parentJoint), []).append(entry)
    ends: list[int] = []
    for leaf in (joint for joint in range(1, model.njoints) if len(model.subtrees[joint]) == 1):
        chain = motion.chain(leaf)
        solid = [joint for joint in chain if joint in carried] if any(joint > 0 for joint in carried) else chain
        if not solid:
            said.append(f"joint {shown(model.names[leaf])} moves nothing that can touch: no finger")
        elif solid[-1] not in ends:
            ends.append(solid[-1])
    inner = {joint for end in ends for joint in motion.chain(end)[:-1]}
    fingers = [_finger(motion, joint, carried.get(joint, [])) for joint in ends if joint not in inner]
    kept = []
    for finger in fingers:
        if any(_covers(motion, other, finger) for other in fingers if other is not finger):
            said.append(f"link of joint {shown(model.names[finger.joint])} lies along another finger: no finger")
        else:
            kept.append(finger)
    return tuple(kept), tuple(said)


def _finger(motion: HandMotion, joint: int, geometries: list[Any]) -> Finger:
    """Return the finger that ends in a joint."""
    if not geometries:
        frames = [f for f in motion.model.frames if f.parentJoint == joint]
        points = np.array([frame.placement.translation for frame in frames])
    else:
        points = link_points(geometries)
    return Finger(joint, tuple(motion.chain(joint)), tuple(geometries), points)


def _covers(motion: HandMotion, finger: Finger, short: Finger) -> bool:
    """Return whether a finger with the same motor covers the end of a shorter one, open and closed."""
    same_motor = bool((motion.drives(finger.joint) == motion.drives(short.joint)).all())
    if not same_motor or not short.geometries or len(finger.chain) <= len(short.chain):
        return False
    others = [e for e in motion.collision_model.geometryObjects if int(e.parentJoint) in finger.chain]
    if not set(finger.chain).isdisjoint(short.chain) or not others:
        return False
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    for q in (motion.lower, 0.5 * (motion.lower + motion.upper), motion.upper):
        poses = motion.poses(q)
        ball = coal.Transform3s(np.eye(3), poses[short.joint].act(short.end))
        near = np.inf
        for entry in others:
            pose = poses[entry.parentJoint] * entry.placement
            placed = coal.Transform3s(np.array(pose.rotation), np.array(pose.translation))
            result.clear()
            near = min(near, float(coal.distance(entry.geometry, placed, coal.Sphere(1e-4), ball, request, result)))
        if near > COVERED:
            return False
    return True
