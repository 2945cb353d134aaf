"""Does a planned grasp close: an open hand moved by its references, the object held, then let go and pushed.

A quasi-static computation: springs, equilibrium, contact and friction at every step, no masses. Only the contacts of
the plan touch; what other links do on the way is left to the simulation (:mod:`grasp_planner.simulate`). Contacts
transmit forces only: what a soft finger adds by torsion is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..hand.configuration import HandConfiguration
from ..judge.posed_grasp import PosedGrasp
from ..model.compliance import hand_stiffness
from ..spatial import Array, Pose
from .newton import RestEvaluator
from .path import ReferencePath, free_posture, posture_overlaps, reference_paths
from .report import OPEN_OVERLAP, ClosingReport
from .rest import RestState
from .together import Work, run_together
from .touches import Touches, find_touches
from .walk import Walk

BUDGET, PUSH_BUDGET = 500, 120
"""Most evaluations of closing and release, and of a push; whatever takes more counts as lost."""
PUSH, SAFETY = 1.0, 1.5
"""Force the object is pushed with where no load case names one [N]; it is pushed harder by the second factor: statics
knows nothing of the swing with which an object settles in a hand that lets it go."""
BEYOND = (1.0, 1.4)
"""How far the references go on from touching towards the plan's, and where that does not hold, beyond them."""
MOST_EVALUATIONS = 800
"""Evaluations of all ways of a grasp after which no further way is tried."""
PUSHES = np.vstack([np.eye(3), -np.eye(3)])
"""Directions of the pushes."""


def close_grasp(grasp: PosedGrasp, path: ReferencePath | None = None, *, safety: float = SAFETY) -> ClosingReport:
    """Return how a grasp closes.

    Args:
        grasp: The grasp.
        path: The references; if None, of several ways the first that holds, or else the one that comes nearest.
        safety: How many times as hard as the load cases it is pushed.

    Returns:
        How it closes.
    """
    return close_grasps([grasp], path, safety=safety)[0]


def close_grasps(
    grasps: Sequence[PosedGrasp], path: ReferencePath | None = None, *, safety: float = SAFETY, free: bool = False
) -> list[ClosingReport]:
    """Return how grasps close; those of one problem are computed together, and many cost little more than one.

    Args:
        grasps: The grasps.
        path: The references of all; if None, each finds its own, as in :func:`close_grasp`.
        safety: How many times as hard as the load cases they are pushed.
        free: Along a path that is given: whether nothing holds the object while the hand closes. Without weight, it
            then gives way to the fingers, and weighs at last.

    Returns:
        How each closes.
    """
    reports: dict[int, ClosingReport] = {}
    alike: dict[int, list[int]] = {}
    for index, grasp in enumerate(grasps):
        alike.setdefault(id(grasp.problem), []).append(index)
    for indices in alike.values():
        chosen = [grasps[index] for index in indices]
        works = (_best_way(each, safety) if path is None else _closing(each, path, safety, free) for each in chosen)
        ended = run_together(RestEvaluator(chosen[0].problem), works)
        reports.update((index, report) for index, (report, _) in zip(indices, ended, strict=True))
    return [reports[index] for index in range(len(grasps))]


def _best_way(grasp: PosedGrasp, safety: float) -> Work[tuple[ClosingReport, int]]:
    """Return the best of several ways, whether it also holds an object that is free, and the evaluations of all."""
    best, used = yield from _first_way(grasp, safety)
    if best.holds:
        freely, more = yield from _closing(grasp, best.path, 1.0, free=True)
        best, used = replace(best, holds_free=freely.holds), used + more
    return best, used


def _first_way(grasp: PosedGrasp, safety: float) -> Work[tuple[ClosingReport, int]]:
    """Return of several ways the first that holds, or the one that comes nearest, and the evaluations of all."""
    best: ClosingReport | None = None
    used = 0
    # Where the plan itself does not keep the links clear, they do not count in the open hand either.
    clear = max(posture_overlaps(grasp.problem, grasp.joint_angles, grasp.palm_pose)) <= OPEN_OVERLAP
    for way in reference_paths(grasp, links=clear):
        for factor in BEYOND:
            report, evaluations = yield from _closing(grasp, way.beyond(factor), safety)
            if best is None or report.rank < best.rank:
                best = report
            used += evaluations
            if best.holds or used > MOST_EVALUATIONS:
                return best, used
            if not report.worth_squeezing:
                break
    assert best is not None
    return best, used


def _closing(
    grasp: PosedGrasp, path: ReferencePath, safety: float, free: bool = False
) -> Work[tuple[ClosingReport, int]]:
    """Close, let go, push; return how that went, and its evaluations."""
    problem = grasp.problem
    touches = find_touches(grasp, path)
    walk = Walk(grasp, path, touches, BUDGET)
    rest = yield from walk.closed(free=free)
    if rest is not None:
        rest = yield from walk.released(rest)
    used, n_c = walk.solver.used, len(problem.frames)
    push = safety * (problem.loads.force or PUSH)
    forces: Array = np.full((n_c, 3), np.nan)
    use: Array = np.zeros(n_c)
    pushes: Array = np.full(len(PUSHES), np.inf)
    displacement = rotation = overlap = torque_use = np.inf
    if rest is not None:
        (displacement, rotation), forces, use = walk.motion(rest), rest.forces, _cone_use(grasp, rest)
        overlap = max(posture_overlaps(problem, rest.q, Pose(rest.rotation, rest.translation)))
        torque_use = float((_torques(grasp, rest) / problem.torque_limits).max())
        tried = yield [_pushed(grasp, path, touches, rest, push * way) for way in PUSHES]
        pushes = np.array([moved for moved, _ in tried])
        used += sum(evaluations for _, evaluations in tried)
    mismatch, mismatch_force = _mismatch(grasp, touches)
    report = ClosingReport(
        path=path,
        pregrasp=free_posture(grasp, path.open),
        names=tuple(frame.name for frame in problem.frames),
        times=touches.times,
        points=touches.points,
        mismatch=mismatch,
        mismatch_force=mismatch_force,
        forces=forces,
        cone_use=use,
        slip=walk.slip,
        overlap=overlap,
        displacement=displacement,
        rotation=rotation,
        torque_use=torque_use,
        pushes=pushes,
        push=push,
    )
    return report, used


def _pushed(
    grasp: PosedGrasp, path: ReferencePath, touches: Touches, rest: RestState, force: Array
) -> Work[tuple[float, int]]:
    """Return how far a push moves the object [m], infinite if it is lost, and the evaluations that took."""
    walk = Walk(grasp, path, touches, PUSH_BUDGET)
    state = yield from walk.pushed(rest, np.concatenate([force, np.zeros(3)]))
    return np.inf if state is None else walk.motion(state)[0], walk.solver.used


def _mismatch(grasp: PosedGrasp, touches: Touches) -> tuple[Array, Array]:
    """Return how far fingers touch from their contacts [m], and by the stiffness of each finger [N], (n_c,) each."""
    problem, points = grasp.problem, grasp.contacts.points
    off = touches.points - points
    jacobian = grasp.configuration.contact_jacobian(problem.frames, points)
    stiffness = hand_stiffness(jacobian, 1e-9, problem.joint_compliance)
    n_c = len(off)
    blocks = stiffness.reshape(n_c, 3, n_c, 3)[np.arange(n_c), :, np.arange(n_c), :]
    return np.linalg.norm(off, axis=1), np.linalg.norm(np.einsum("ijk,ik->ij", blocks, off), axis=1)


def _cone_use(grasp: PosedGrasp, state: RestState) -> Array:
    """Return |f_t|/(μ f_n) of every contact, 0 without contact, of shape (n_c,)."""
    problem, forces = grasp.problem, state.forces
    friction = problem.friction * problem.contact_model.has_friction
    normal = np.einsum("ij,ij->i", forces, state.normals)
    across = np.linalg.norm(forces - normal[:, None] * state.normals, axis=1)
    return np.where(normal > 1e-9, across / np.maximum(friction * normal, 1e-9), 0.0)


def _torques(grasp: PosedGrasp, state: RestState) -> Array:
    """Return the sizes of the joint torques of the contact forces [N m], of shape (n_q,)."""
    problem = grasp.problem
    configuration = HandConfiguration(problem.hand, state.q, Pose(state.rotation, state.translation))
    points = state.centres + problem.radii[:, None] * state.normals
    jacobian = configuration.contact_jacobian(problem.frames, points)
    return np.abs(jacobian.T @ state.forces.ravel())
