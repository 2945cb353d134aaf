"""Where and when the fingers of a free closing hand touch the object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ..hand.kinematics import HandKinematics
from ..judge.posed_grasp import PosedGrasp
from ..model.contacts import find_contacts
from ..spatial import Array
from .path import ReferencePath, free_posture

SAMPLES = 33
"""Postures of the free path at which gaps are looked at first."""
ACCURACY = 1e-7
"""Accuracy of the times of touches; fingertips move by some centimetres in a unit of time."""


@dataclass(frozen=True)
class Touches:
    """First touches of a free closing hand, the object held; frame O.

    Attributes:
        times: When each finger touches, 0 open to 2 squeezed; infinite if it never does, of shape (n_c,).
        centres: Fingertips, or centres of their spheres, at the touch (at the end, without one) [m], of shape (n_c, 3).
        points: Contact points on the surface; without a touch where the surface is nearest [m], of shape (n_c, 3).
        postures: Free postures at the touches [rad], of shape (n_c, n_q).
        gaps: Gaps at the end of the path for fingers that never touch, 0 for the others [m], of shape (n_c,).
    """

    times: Array
    centres: Array
    points: Array
    postures: Array
    gaps: Array


def find_touches(grasp: PosedGrasp, path: ReferencePath) -> Touches:
    """Return where and when every finger first touches as the free hand closes.

    Args:
        grasp: The grasp, for problem and palm pose.
        path: The references.

    Returns:
        The touches.
    """
    problem, pose = grasp.problem, grasp.palm_pose
    kinematics = HandKinematics(problem.hand, problem.frames)

    def centres(time: float) -> Array:
        q = free_posture(grasp, path.at(time))
        return kinematics.compute(q, angular=False).position @ pose.rotation.T + pose.translation

    def gap(time: float, i: int) -> float:
        return float(solid.sample(centres(time)[i : i + 1]).distance[0] - radii[i])

    n_c, radii, solid = len(problem.frames), problem.radii, problem.grasp_object.solid
    grid = np.linspace(0.0, 2.0, SAMPLES)
    places = np.array([centres(time) for time in grid])
    gaps = solid.sample(places.reshape(-1, 3)).distance.reshape(SAMPLES, n_c) - radii
    times, where, left = np.full(n_c, np.inf), np.array(places[-1]), np.array(gaps[-1])
    for i in range(n_c):
        inside = np.flatnonzero(gaps[:, i] <= 0.0)
        if not inside.size:
            continue
        last = int(inside[0])
        touch = float(grid[last])
        if last > 0 and gaps[last, i] < 0.0:
            touch = brentq(gap, grid[last - 1], grid[last], args=(i,), xtol=ACCURACY)
        times[i], where[i], left[i] = touch, centres(touch)[i], 0.0
    postures = np.array([free_posture(grasp, path.at(min(time, 2.0))) for time in times])
    contacts = find_contacts(where, radii, solid)
    points = contacts.points + contacts.gaps[:, None] * contacts.normals
    return Touches(times, where, points, postures, left)
