"""Does a planned grasp close: an open hand moved by its references, the object held, then let go and pushed.

A quasi-static computation: springs, equilibrium, contact and friction at every step, no masses. Only the contacts of
the plan touch; what other links do on the way is left to the simulation (:mod:`grasp_planner.simulate`). Contacts
transmit forces only: what a soft finger adds by torsion is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..judge.posed_grasp import PosedGrasp
from ..model.compliance import hand_stiffness
from ..spatial import Array, Pose
from ..values import Value
from .equilibrium import Anchors, Conditions, RestSolver, RestState
from .path import ReferencePath, free_posture, posture_overlaps, reference_paths
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
PUSH = 1.0
"""Force the object is pushed with where no load case names one [N]."""
OPEN_OVERLAP = 1e-3
"""Deepest overlap of the open hand with itself or the object with which a closing may begin [m], as in simulation."""
MAX_DISPLACEMENT, MAX_ROTATION = 0.05, np.radians(15.0)
"""How far the object may move [m] and turn [rad], as in simulation."""


Step = Callable[[RestState, float, float, bool], RestState | None]
"""From a state at a time to the state at a later one, the last resort included or not."""


@dataclass(frozen=True, eq=False, repr=False)
class ClosingReport(Value):
    """How a grasp closes from an open hand, and whether it then holds; frame O of the plan.

    Attributes:
        path: The references from the open hand to the plan's, the best of several ways.
        pregrasp: Posture of the open hand, the palm where it is planned [rad], of shape (n_q,).
        names: Names of the contacts.
        times: When each finger touches: 0 open, 1 the touching references, 2 the plan's; infinite without a touch.
        points: Where each finger first touches the object, or where the surface is nearest [m], of shape (n_c, 3).
        mismatch: Distance of these points from the planned contacts [m], of shape (n_c,).
        mismatch_force: The same by the stiffness of the fingers, the palm and the references held [N], of shape (n_c,).
        forces: Of the hand on the object at rest, the object free [N], of shape (n_c, 3); nan if it is lost.
        cone_use: |f_t|/(μ f_n) at rest, 0 without contact, of shape (n_c,).
        slip: How far each contact slid over the object, closing and release together [m], of shape (n_c,).
        overlap: Deepest overlap of a link that is no contact with the object or another link at rest [m].
        displacement: Of the object at rest [m].
        rotation: Of the object at rest [rad].
        pushes: How far a push along ±x, ±y, ±z moves it [m]; infinite where it is lost, of shape (6,).
        push: How strong these pushes are [N].
    """

    path: ReferencePath
    pregrasp: Array
    names: tuple[str, ...]
    times: Array
    points: Array
    mismatch: Array
    mismatch_force: Array
    forces: Array
    cone_use: Array
    slip: Array
    overlap: float
    displacement: float
    rotation: float
    pushes: Array
    push: float

    @property
    def order(self) -> tuple[str, ...]:
        """Names of the fingers that touch, the first first."""
        return tuple(self.names[i] for i in np.argsort(self.times, kind="stable") if np.isfinite(self.times[i]))

    @property
    def rests(self) -> bool:
        """Whether the hand, closed, has the object at rest."""
        return bool(np.isfinite(self.displacement))

    @property
    def holds(self) -> bool:
        """Whether the open hand is free, closes and then holds every push."""
        return self.opens and self.rests and bool(np.isfinite(self.pushes).all())

    @property
    def opens(self) -> bool:
        """Whether the open hand overlaps neither the object nor itself."""
        return self.path.overlap <= OPEN_OVERLAP

    @property
    def rank(self) -> tuple[float, ...]:
        """What ways of closing are ordered by, the best first: opens, rests, pushes held, mismatch."""
        return not self.opens, not self.rests, float(np.isinf(self.pushes).sum()), float(self.mismatch.max())

    @property
    def worst(self) -> int:
        """The contact that touches farthest from the plan."""
        return int(np.argmax(self.mismatch))

    @property
    def text(self) -> str:
        """One sentence."""
        off = f"{self.names[self.worst]} touches {1e3 * self.mismatch[self.worst]:.1f} mm off"
        missing = [name for name, time in zip(self.names, self.times, strict=True) if not np.isfinite(time)]
        if missing:
            off = f"{' and '.join(missing)} would not touch; {off}"
        if self.holds:
            return f"closes from open: {off}, the object moves {1e3 * self.displacement:.1f} mm"
        if not self.opens:
            return f"does not close: the open hand overlaps by {1e3 * self.path.overlap:.1f} mm"
        lost = int(np.isinf(self.pushes).sum())
        what = f"{lost} of {len(self.pushes)} pushes of {self.push:g} N lost" if self.rests else "the object is lost"
        return f"does not close: {off}, {what}"


def close_grasp(grasp: PosedGrasp, path: ReferencePath | None = None) -> ClosingReport:
    """Return how a grasp closes.

    Args:
        grasp: The grasp.
        path: The references; if None, of several ways the first that holds, or else the one that comes nearest.

    Returns:
        How it closes.
    """
    if path is not None:
        return _Run(grasp, path).result()
    best: ClosingReport | None = None
    # Where the plan itself does not keep the links clear, they do not count in the open hand either.
    clear = max(posture_overlaps(grasp.problem, grasp.joint_angles, grasp.palm_pose)) <= OPEN_OVERLAP
    for way in reference_paths(grasp, links=clear):
        report = _Run(grasp, way).result()
        if best is None or report.rank < best.rank:
            best = report
        if best.holds:
            break
    assert best is not None
    return best


class _Run:
    """One closing hand."""

    def __init__(self, grasp: PosedGrasp, path: ReferencePath) -> None:
        self.grasp, self.path = grasp, path
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
        push = problem.loads.force or PUSH
        forces, use, pushes = np.full((n_c, 3), np.nan), np.zeros(n_c), np.full(6, np.inf)
        displacement = rotation = overlap = np.inf
        if rest is not None:
            (displacement, rotation), forces = self._motion(rest), rest.forces
            normal = np.einsum("ij,ij->i", forces, rest.normals)
            across = np.linalg.norm(forces - normal[:, None] * rest.normals, axis=1)
            use = np.where(normal > 1e-9, across / np.maximum(self.solver.friction * normal, 1e-9), 0.0)
            pose = Pose(rest.rotation, rest.translation)
            overlap = max(posture_overlaps(problem, rest.q, pose))
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

    def _motion(self, state: RestState) -> tuple[float, float]:
        """Return how far the object has moved [m] and turned [rad] in a state."""
        turn = self.home @ state.rotation.T
        cosine = np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0)
        return float(np.linalg.norm(self.origin - turn @ state.translation)), float(np.arccos(cosine))
