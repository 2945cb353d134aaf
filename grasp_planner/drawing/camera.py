"""Where to look at a grasp from: the view in which most contacts are seen and least is hidden."""

from __future__ import annotations

from itertools import product

import numpy as np

from ..grasp.grasp import Grasp
from ..spatial import Array
from .look import TASK_LENGTH
from .meshes import link_meshes, link_placements
from .view import fitted

FIELD_OF_VIEW = 0.7
"""Vertical field of view of the camera [rad]."""
ASPECT = 0.85
"""Width over height that everything fits into: of a small window beside the panel."""
TASK_REACH = 1.12
"""How far the ball at the tip of the task's arrow reaches, as a share of its length."""
AZIMUTHS, ELEVATIONS = 24, (0.2, 0.4, 0.6)
OWN_LINK = 0.014
"""Surface this near to a contact is the fingertip itself and hides nothing [m]."""
NARROW = 0.008
"""Surface this near to a line of sight hides what is behind it [m]."""


def good_view(grasp: Grasp) -> tuple[Array, Array]:
    """Return position and target of a good view on a grasp.

    Args:
        grasp: The grasp.

    Returns:
        Both in O [m], of shape (3,).
    """
    cloud = _surface(grasp)
    extents = grasp.problem.grasp_object.half_extents
    box = np.array(list(product((-1.0, 1.0), repeat=3))) * extents
    corners = np.vstack([cloud, box, TASK_REACH * TASK_LENGTH * _task_direction(grasp)])
    target = 0.5 * grasp.contacts.points.mean(axis=0) + 0.25 * (corners.min(axis=0) + corners.max(axis=0))
    reach = float(np.linalg.norm(cloud - target, axis=1).max())
    distance = 0.92 * reach / np.tan(FIELD_OF_VIEW / 2.0)
    candidates = [
        np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
        for rise in ELEVATIONS
        for turn in np.linspace(0.0, 2.0 * np.pi, AZIMUTHS, endpoint=False)
    ]
    scores = _scores(grasp, target + distance * np.array(candidates), cloud)
    return fitted(corners, candidates[int(np.argmax(scores))], FIELD_OF_VIEW, ASPECT)


def _scores(grasp: Grasp, eyes: Array, cloud: Array) -> Array:
    """Return how many contacts each eye sees, and slightly how well task and forces lie across its view."""
    views = -eyes / np.linalg.norm(eyes, axis=1, keepdims=True)
    scores = 1.5 * (1.0 - np.abs(views @ _task_direction(grasp))) - 0.5 * np.abs(views[:, 2])
    for point, normal in zip(grasp.contacts.points, grasp.contacts.normals, strict=True):
        rays = (point - eyes) / np.linalg.norm(point - eyes, axis=1, keepdims=True)
        beside = cloud - point
        distances = np.linalg.norm(beside, axis=1)
        beside, distances = beside[distances > OWN_LINK], distances[distances > OWN_LINK]
        along = beside @ rays.T
        hiding = (along < -1e-3) & (distances[:, None] ** 2 - along**2 < NARROW**2)
        scores += np.where(hiding.any(axis=0), 0.0, 1.0 + 0.3 * (1.0 - np.abs(rays @ normal)))
    return scores


def _task_direction(grasp: Grasp) -> Array:
    """Return the unit direction of the first task, linear or else angular, of shape (3,)."""
    task = grasp.problem.tasks[0].direction
    part = task[:3] if task[:3].any() else task[3:]
    return part / np.linalg.norm(part)


def _surface(grasp: Grasp) -> Array:
    """Return points on the surface of the hand in O [m], of shape (n, 3)."""
    placements = link_placements(grasp.problem.hand, grasp.joint_angles, grasp.palm_pose)
    clouds = []
    for entry in link_meshes(grasp.problem.hand):
        mesh = entry.mesh.subdivide_to_size(0.02)
        placement = placements[entry.geometry_id]
        clouds.append(np.array(mesh.vertices) @ np.array(placement.rotation).T + np.array(placement.translation))
    return np.vstack(clouds)
