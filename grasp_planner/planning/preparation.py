"""Prepared starts: the hand moves along its synergies alone until its contacts and its forces nearly fit the object.

With few synergies hardly any random start lies in the solver's reach. But the rigid hand q = q̄ + S σ has few
degrees of freedom, so fitting (σ, palm pose, δσ) is cheap, can be repeated from many starts, and the best fits,
which compliance then closes, go to the planner. Cones count by angle and not by newtons here: without synergies
enough to choose them, contact forces have one direction each, and what matters is whether it lies in its cone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ..evaluation.state import GraspState
from ..model.contact_model import HardFinger
from ..problem.problem import GraspProblem
from ..problem.term import RADIAN
from ..spatial import Array
from .least_squares import restore_feasibility
from .neighbours import NearGrasps
from .phase_one import no_margin, pressing, weighted_residuals, wide_margin
from .pooled_starts import pooled_starts
from .program import JOINT_SCALE, GraspProgram
from .starts import GraspStart, random_start, standard_start

FEW_SYNERGIES = 4
"""Up to this many synergies starts are prepared, and every start is made feasible first (phase one)."""
ROUND = 40
"""Starts prepared at a time."""
TAKEN = 6
"""Best of them handed to the planner before the next are prepared."""
FIRST_UNPREPARED, UNPREPARED = 12, 4
"""Random starts as they are, before the first round and between rounds."""
HOPELESS = 150.0
"""Misfit from which a prepared start is left out."""
ALIKE = 0.02
"""Distance of σ [rad] below which two prepared starts with the same misfit count as one."""
CONE_TARGET = 0.12
"""Least (μ f_n − |f_t|)/|f| asked of every contact force."""
CONE_WEIGHT = 15.0
"""Weight of what is missing of it; against 1 for a millimetre of gap."""
TOTAL_FORCE, TOTAL_WEIGHT = 6.0, 0.3
"""Sum of normal forces to start from [N], and its weight [1/N]."""
FORCE_FLOOR = 0.1
"""Added under the root of |f|, so that its direction exists without load [N]."""
EVALUATIONS = 60


@dataclass(frozen=True)
class PreparedStart:
    """A start fitted along the synergies.

    Attributes:
        start: The start.
        misfit: Sum of squared weighted violations that remain; a millimetre of gap counts 1.
        sigma: σ [rad], of shape (n_s,).
        evaluations: States evaluated for it.
    """

    start: GraspStart
    misfit: float
    sigma: Array
    evaluations: int


def search_starts(
    problem: GraspProblem,
    rng: np.random.Generator,
    first: GraspStart | None = None,
    check: Callable[[], None] = lambda: None,
    grasps: NearGrasps | None = None,
) -> Iterator[GraspStart]:
    """Yield the starts of a search, without end.

    Where forces come from springs, those of :mod:`grasp_planner.planning.pooled_starts`. By (17) the standard start and
    random ones; with few synergies, after some of these, rounds of prepared ones, the best of each round first,
    and a few random ones after each round.

    Args:
        problem: The problem.
        rng: Source of random numbers.
        first: A start to begin with, as it is.
        check: Called at every evaluation of a preparation; may raise to stop.
        grasps: Grasps near which, where forces come from springs, most starts are made as soon as there are any.

    Yields:
        Starts, ``first`` before all others.
    """
    springs = problem.parameters.force_law == "springs"
    if first is not None:
        yield first
    elif not springs or not isinstance(problem.contact_model, HardFinger):
        yield standard_start(problem)
    if springs and isinstance(problem.contact_model, HardFinger):
        yield from pooled_starts(problem, rng, check, grasps)
    unprepared = FIRST_UNPREPARED
    while True:
        for _ in range(unprepared):
            yield random_start(problem, rng)
        if problem.n_synergies <= FEW_SYNERGIES and not springs:
            best = best_prepared(problem, [random_start(problem, rng) for _ in range(ROUND)], check)
            yield from (each.start for each in best[:TAKEN] if each.misfit < HOPELESS)
            unprepared = UNPREPARED


def best_prepared(
    problem: GraspProblem, starts: Sequence[GraspStart], check: Callable[[], None] = lambda: None
) -> list[PreparedStart]:
    """Return prepared starts, the best first, without repetitions and those that fail numerically.

    Args:
        problem: The problem.
        starts: Where to begin.
        check: Called at every evaluation; may raise to stop.

    Returns:
        The prepared starts.
    """
    found: list[PreparedStart] = []
    for start in starts:
        with suppress(ValueError, FloatingPointError, np.linalg.LinAlgError):
            found.append(prepare_start(problem, start, check))
    chosen: list[PreparedStart] = []
    for candidate in sorted(found, key=lambda each: each.misfit):
        if all(np.linalg.norm(candidate.sigma - each.sigma) >= ALIKE for each in chosen):
            chosen.append(candidate)
    return chosen


def prepare_start(problem: GraspProblem, start: GraspStart, check: Callable[[], None] = lambda: None) -> PreparedStart:
    """Return a start moved along the synergies to where gaps, cones and limits are violated least.

    Args:
        problem: The problem.
        start: Where to begin.
        check: Called at every evaluation; may raise to stop.

    Returns:
        The prepared start.

    Raises:
        ValueError, numpy.linalg.LinAlgError: If G loses rank on the way.
    """
    motion = _SynergyMotion(GraspProgram(problem, start.palm_pose))
    y = motion.begin(start)

    def equality(y: Array) -> tuple[Array, Array]:
        check()
        return motion.contacts(y)

    lower, upper = motion.bounds()
    y = restore_feasibility(
        equality,
        motion.inequalities,
        y,
        lower,
        upper,
        max_evaluations=EVALUATIONS,
        tolerance=1e-4,
        regularisation=1e-2,
    )
    missing = np.minimum(motion.inequalities(y)[0], 0.0)
    misfit = float(np.sum(np.square(motion.contacts(y)[0])) + np.sum(np.square(missing)))
    return PreparedStart(motion.start(y), misfit, motion.sigma(y), motion.program.evaluations)


class _SynergyMotion:
    """The problem's violations as functions of y = (σ, palm pose, δσ), in scaled units, with q = q̄ + S σ."""

    def __init__(self, program: GraspProgram) -> None:
        self.program, self.problem = program, program.problem
        layout, n_s = program.evaluator.layout, program.problem.n_synergies
        self._z0 = np.zeros(layout.size)
        self._z0[layout.joints] = self.problem.synergies.mean / program.scale[layout.joints]
        self._slope = np.zeros((layout.size, n_s + layout.size - layout.n_joints))
        self._slope[layout.joints, :n_s] = self.problem.synergies.basis * (
            JOINT_SCALE / program.scale[layout.joints, None]
        )
        self._slope[layout.n_joints :, n_s:] = np.eye(layout.size - layout.n_joints)
        self._geometric = [term for term in program.constraints if term.geometric]

    def begin(self, start: GraspStart) -> Array:
        """Return y at a start, with the δσ that presses with 2 N at every contact as well as can be."""
        layout, n_s = self.program.evaluator.layout, self.problem.n_synergies
        y = np.zeros(self._slope.shape[1])
        y[:n_s] = self.problem.synergies.basis.T @ (start.joint_angles - self.problem.synergies.mean) / JOINT_SCALE
        y[-n_s:] = pressing(self.program, self._z(y))[layout.displacement]
        return y

    def bounds(self) -> tuple[Array, Array]:
        """Return bounds of y: the reach of the palm; σ and δσ are free."""
        lower, upper = self.program.bounds()
        layout, n_s = self.program.evaluator.layout, self.problem.n_synergies
        free = np.full(n_s, np.inf)
        return np.append(-free, lower[layout.n_joints :]), np.append(free, upper[layout.n_joints :])

    def sigma(self, y: Array) -> Array:
        """Return σ [rad]."""
        return y[: self.problem.n_synergies] * JOINT_SCALE

    def start(self, y: Array) -> GraspStart:
        """Return the start at y, within joint limits."""
        layout, hand = self.program.evaluator.layout, self.problem.hand
        x = self._z(y) * self.program.scale
        q = np.clip(x[layout.joints], hand.lower, hand.upper)
        return GraspStart(q, self.program.evaluator.palm_pose(x), x[layout.displacement], prepared=True)

    def contacts(self, y: Array) -> tuple[Array, Array]:
        """Return the gaps and the sum of normal forces less its target, weighted, and their derivatives."""
        z = self._z(y)
        state = self.program.state(z)
        gaps, d_gaps = weighted_residuals(
            self.program, z, [term for term in self._geometric if term.equality], no_margin
        )
        total = TOTAL_WEIGHT * (state.normal_forces.sum() - TOTAL_FORCE)
        d_total = TOTAL_WEIGHT * state.d_normal_forces.sum(axis=0) * self.program.scale
        return np.append(gaps, total), np.vstack([d_gaps, d_total]) @ self._slope

    def inequalities(self, y: Array) -> tuple[Array, Array]:
        """Return what is left of cones, clearances and joint limits, weighted, and its derivatives."""
        z = self._z(y)
        state, hand, layout = self.program.state(z), self.problem.hand, self.program.evaluator.layout
        cones, d_cones = _cone_shares(state)
        terms = [term for term in self._geometric if not term.equality]
        kept, d_kept = weighted_residuals(self.program, z, terms, wide_margin)
        q = state.x[layout.joints]
        d_q = RADIAN.weight * np.eye(layout.size)[layout.joints] * self.program.scale
        value = np.concatenate([CONE_WEIGHT * (cones - CONE_TARGET), kept, RADIAN.weight * (q - hand.lower)])
        slope = np.vstack([CONE_WEIGHT * d_cones * self.program.scale, d_kept, d_q])
        return np.append(value, RADIAN.weight * (hand.upper - q)), np.vstack([slope, -d_q]) @ self._slope

    def _z(self, y: Array) -> Array:
        """Return the scaled variables of the planner at y."""
        return self._z0 + self._slope @ y


def _cone_shares(state: GraspState) -> tuple[Array, Array]:
    """Return (μ f_n − |f_t|)/|f| of every contact, f its intensities, and its derivatives by x."""
    forces = state.intensities
    size = np.sqrt(np.einsum("ij,ij->i", forces, forces) + FORCE_FLOOR**2)
    d_size = (forces[:, None, :] @ state.d_intensities.reshape(*forces.shape, -1))[:, 0] / size[:, None]
    shares = state.friction_margins / size
    return shares, (state.d_friction_margins - shares[:, None] * d_size) / size[:, None]
