"""Does a planned grasp close: an open hand moved by its references, the object held, then let go and pushed.

A quasi-static computation: springs, equilibrium, contact and friction at every step, no masses. Only the contacts of
the plan touch; what other links do on the way is left to the simulation (:mod:`grasp_planner.simulate`). Contacts
transmit forces only: what a soft finger adds by torsion is left out.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..hand.configuration import HandConfiguration
from ..judge.posed_grasp import PosedGrasp
from ..model.compliance import hand_stiffness
from ..spatial import Array, Pose
from .equilibrium import Anchors, Conditions, RestSolver, RestState
from .path import ReferencePath, free_posture, posture_overlaps, reference_paths
from .report import OPEN_OVERLAP, ClosingReport
from .touches import Touches, find_touches

CLOSING_STEPS = 8
"""Steps of the references from the first touch to the squeeze."""
MAX_DEPTH = 2
"""How often a step is halved before it counts as impossible."""
DRAGS = (2e3, 1e3, 5e2, 2e2, 1e2, 50.0)
"""Drags of the object with which it creeps to a state of rest, one after the other [N/m] …"""
CREPT = 0.005
"""… until this force stops it [N]."""
BUDGET, PUSH_BUDGET = 500, 120
"""Most evaluations of closing and release, and of a push; whatever takes more counts as lost."""
PUSH, SAFETY = 1.0, 1.5
"""Force the object is pushed with where no load case names one [N]; it is pushed harder by the second factor: statics
knows nothing of the swing with which an object settles in a hand that lets it go."""
BEYOND = (1.0, 1.4)
"""How far the references go on from touching towards the plan's, and where that does not hold, beyond them."""
MOST_EVALUATIONS = 800
"""Evaluations of all ways of a grasp after which no further way is tried."""
MAX_DISPLACEMENT, MAX_ROTATION = 0.05, np.radians(15.0)
"""How far the object may move [m] and turn [rad], as in simulation."""


Step = Callable[[RestState, float, float, bool], RestState | None]
"""From a state at a time to the state at a later one, the last resort included or not."""


def close_grasp(grasp: PosedGrasp, path: ReferencePath | None = None, *, safety: float = SAFETY) -> ClosingReport:
    """Return how a grasp closes.

    Args:
        grasp: The grasp.
        path: The references; if None, of several ways the first that holds, or else the one that comes nearest.
        safety: How many times as hard as the load cases it is pushed.

    Returns:
        How it closes.
    """
    if path is not None:
        return _Run(grasp, path, safety).result()
    best: ClosingReport | None = None
    used = 0
    # Where the plan itself does not keep the links clear, they do not count in the open hand either.
    clear = max(posture_overlaps(grasp.problem, grasp.joint_angles, grasp.palm_pose)) <= OPEN_OVERLAP
    for way in reference_paths(grasp, links=clear):
        for factor in BEYOND:
            run = _Run(grasp, way.beyond(factor), safety)
            report = run.result()
            if best is None or report.rank < best.rank:
                best = report
            used += run.solver.used
            if best.holds or used > MOST_EVALUATIONS:
                return best
            if not report.worth_squeezing:
                break
    assert best is not None
    return best


class _Run:
    """One closing hand."""

    def __init__(self, grasp: PosedGrasp, path: ReferencePath, safety: float) -> None:
        self.grasp, self.path, self.safety = grasp, path, safety
        self.touches: Touches = find_touches(grasp, path)
        self.solver = RestSolver(grasp.problem, grasp.palm_pose)
        self.home, self.origin = grasp.palm_pose.rotation, grasp.palm_pose.translation
        self.synergies = grasp.problem.synergies
        self.slip = np.zeros(len(grasp.problem.frames))

    def result(self) -> ClosingReport:
        """Close, let go, push."""
        problem, contacts = self.grasp.problem, self.grasp.contacts
        off = self.touches.points - contacts.points
        jacobian = self.grasp.configuration.contact_jacobian(problem.frames, contacts.points)
        stiffness = hand_stiffness(jacobian, 1e-9, problem.joint_compliance)
        n_c = len(off)
        blocks = stiffness.reshape(n_c, 3, n_c, 3)[np.arange(n_c), :, np.arange(n_c), :]
        self.solver.left = BUDGET
        rest = self._released(self._closed())
        push = self.safety * (problem.loads.force or PUSH)
        forces, use, pushes = np.full((n_c, 3), np.nan), np.zeros(n_c), np.full(6, np.inf)
        displacement = rotation = overlap = torque_use = np.inf
        if rest is not None:
            (displacement, rotation), forces = self._motion(rest), rest.forces
            normal = np.einsum("ij,ij->i", forces, rest.normals)
            across = np.linalg.norm(forces - normal[:, None] * rest.normals, axis=1)
            use = np.where(normal > 1e-9, across / np.maximum(self.solver.friction * normal, 1e-9), 0.0)
            pose = Pose(rest.rotation, rest.translation)
            overlap = max(posture_overlaps(problem, rest.q, pose))
            torque_use = float((self._torques(rest) / problem.torque_limits).max())
            pushes = np.array([self._pushed(rest, push * way) for way in np.vstack([np.eye(3), -np.eye(3)])])
        return ClosingReport(
            path=self.path,
            pregrasp=free_posture(self.grasp, self.path.open),
            names=tuple(frame.name for frame in problem.frames),
            times=self.touches.times,
            points=self.touches.points,
            mismatch=np.linalg.norm(off, axis=1),
            mismatch_force=np.linalg.norm(np.einsum("ijk,ik->ij", blocks, off), axis=1),
            forces=forces,
            cone_use=use,
            slip=self.slip,
            overlap=overlap,
            displacement=displacement,
            rotation=rotation,
            torque_use=torque_use,
            pushes=pushes,
            push=push,
        )

    def _closed(self) -> RestState | None:
        """Close the hand around the object that is held."""
        touches, path = self.touches, self.path
        touched = touches.times[np.isfinite(touches.times)]
        if not touched.size:
            return None
        state = self.solver.begin(free_posture(self.grasp, path.open))
        began = float(touched.min())
        for time in np.union1d(touched[touched > began], np.linspace(began, 2.0, CLOSING_STEPS + 1)[1:]):
            found = self._advance(state, began, float(time), self._held)
            if found is None:
                return None
            state, began = found, float(time)
        return state

    def _held(self, state: RestState, began: float, time: float, _: bool) -> RestState | None:
        """Move the references on, the object held."""
        touches = self.touches
        fresh = (touches.times >= began) & (touches.times <= time)
        anchors = Anchors(
            np.where(fresh[:, None], touches.centres, state.centres),
            np.where(fresh[:, None], touches.postures, state.q),
            touches.times <= time,
        )
        return self.solver.solve(state, Conditions(self.synergies.joint_angles(self.path.at(time)), anchors))

    def _advance(self, state: RestState, began: float, time: float, step: Step, depth: int = 0) -> RestState | None:
        """Go from one time to another, in halves where it can't be done at once; None if it can't be done."""
        found = step(state, began, time, depth == MAX_DEPTH)
        if found is not None or depth == MAX_DEPTH:
            if found is not None:
                self.slip = self.slip + found.slips
            return found
        middle = 0.5 * (began + time)
        halfway = self._advance(state, began, middle, step, depth + 1)
        return None if halfway is None else self._advance(halfway, middle, time, step, depth + 1)

    def _released(self, state: RestState | None) -> RestState | None:
        """Let the object go little by little."""
        if state is None:
            return None
        wrench = self.grasp.problem.external_wrench
        held = self.solver.unbalanced(state, wrench)
        return self._advance(
            state, 0.0, 1.0, lambda state, _, time, last: self._free(state, wrench - (1.0 - time) * held, last)
        )

    def _pushed(self, state: RestState, force: Array) -> float:
        """Return how far a push moves the object [m]; infinite if it is lost."""
        wrench, push = self.grasp.problem.external_wrench, np.concatenate([force, np.zeros(3)])
        slip, self.solver.left = self.slip, PUSH_BUDGET
        pushed = self._advance(
            state, 0.0, 1.0, lambda state, _, time, last: self._free(state, wrench + time * push, last)
        )
        self.slip = slip
        return np.inf if pushed is None else self._motion(pushed)[0]

    def _free(self, state: RestState, wrench: Array, creeping: bool) -> RestState | None:
        """Return the next state of rest of the free object, None if it is lost."""
        found = self._rested(state, wrench, 0.0)
        if found is not None or not creeping:
            return found
        # Where fingers slide far there is no way there by equilibria alone: the object creeps until it rests.
        for drag in DRAGS:
            crept = self._rested(state, wrench, drag)
            if crept is None:
                continue
            self.slip = self.slip + crept.slips
            moved = np.linalg.norm(crept.translation - state.translation)
            state = crept
            if drag * moved < CREPT:
                return state
            found = self._rested(state, wrench, 0.0)
            if found is not None:
                return found
        return None

    def _rested(self, state: RestState, wrench: Array, drag: float) -> RestState | None:
        """Return the state of rest of the free object under a drag, None if there is none within the limits."""
        n_c, reference = len(state.gaps), self.synergies.joint_angles(self.path.squeezing)
        anchors = Anchors(state.centres, np.tile(state.q, (n_c, 1)), np.full(n_c, True))
        found = self.solver.solve(state, Conditions(reference, anchors, wrench, drag))
        if found is None:
            return None
        moved, turned = self._motion(found)
        return found if moved <= MAX_DISPLACEMENT and turned <= MAX_ROTATION else None

    def _torques(self, state: RestState) -> Array:
        """Return the sizes of the joint torques of the contact forces [N m], of shape (n_q,)."""
        problem = self.grasp.problem
        configuration = HandConfiguration(problem.hand, state.q, Pose(state.rotation, state.translation))
        points = state.centres + problem.radii[:, None] * state.normals
        jacobian = configuration.contact_jacobian(problem.frames, points)
        return np.abs(jacobian.T @ state.forces.ravel())

    def _motion(self, state: RestState) -> tuple[float, float]:
        """Return how far the object has moved [m] and turned [rad] in a state."""
        turn = self.home @ state.rotation.T
        cosine = np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0)
        return float(np.linalg.norm(self.origin - turn @ state.translation)), float(np.arccos(cosine))
