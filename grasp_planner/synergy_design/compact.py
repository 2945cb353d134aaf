"""Synergies for few motors: one grasp of every object, such that all of them together span few dimensions.

Principal components of grasps planned one by one explain those grasps; but most objects can be grasped in many
ways, and what few motors need is the way that fits the other objects. So the grasps themselves are moved, within
everything that makes them grasps, until their references q_r and displacements S δσ nearly share a small subspace.
The measure of small is Σ log(λ_i + ε²) over the eigenvalues λ of their scatter, made less by reweighting: every grasp
minimises its Mahalanobis distance in the scatter of all, then the scatter is taken anew, with less and less ε
([Fazel2003], the log-det heuristic for matrices of least rank).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from threadpoolctl import threadpool_limits

from ..evaluation.state import GraspState
from ..grasp.grasp import Grasp
from ..judge.posed_grasp import PosedGrasp
from ..optimisation.nlp import solve_nlp
from ..planning.program import JOINT_SCALE, GraspProgram, displacement_step
from ..problem.problem import GraspProblem
from ..problem.term import Cost
from ..spatial import Array
from ..synergies.space import SynergySpace

DISPLACEMENT_WEIGHT = 0.3
"""What the squeezing displacement S δσ counts against the reference posture, both in their typical sizes."""
FORCE_WEIGHT = 1e-4
"""Weight of F [1/N], so that grasps of little force are taken among equally close ones."""
MAX_ITERATIONS = 60
TOLERANCE = 1e-6
CLOSE_ENOUGH = 1e-3
"""Largest scaled violation at which a moved grasp is kept."""
UNIT_SPREAD = 0.05
"""Spread that counts as one in distances [rad]."""


@dataclass(frozen=True)
class FreeGrasp:
    """A grasp of the fully actuated hand, whatever synergies it was planned with.

    Attributes:
        joint_angles: q [rad], of shape (n_q,).
        palm_pose: Pose of the palm frame in O, of shape (4, 4).
        displacement: S δσ [rad], of shape (n_q,).
        reference: q_r [rad], of shape (n_q,).
        contact_forces: Intensities λ in O [N], of shape (n_c, d), where forces come from springs; else None.
        distance: The last distance from the others, dimensionless.
    """

    joint_angles: Array
    palm_pose: Array
    displacement: Array
    reference: Array
    contact_forces: Array | None = None
    distance: float = np.inf


@dataclass(frozen=True)
class Scatter:
    """Where grasps lie in the space of postures.

    Attributes:
        mean: Mean reference posture q̄ [rad], of shape (n_q,).
        covariance: Second moments of references around it and of scaled displacements [rad²], of shape (n_q, n_q).
    """

    mean: Array
    covariance: Array

    def metric(self, epsilon: float) -> Array:
        """Return (Σ + ε² 1)⁻¹ times a unit spread squared, the weights of the next round, of shape (n_q, n_q)."""
        size = len(self.mean)
        return UNIT_SPREAD**2 * np.linalg.inv(self.covariance + epsilon**2 * np.eye(size))

    def flattened(self, n: int) -> Scatter:
        """Return the same scatter with nothing but its n widest directions: all others are to be given up."""
        eigenvalues, vectors = np.linalg.eigh(self.covariance)
        widest, along = np.maximum(eigenvalues[-n:], 0.0), vectors[:, -n:]
        return replace(self, covariance=(along * widest) @ along.T)

    def directions(self, n: int) -> Array:
        """Return its n widest directions, the widest first, each closing more joints than it opens, (n_q, n)."""
        _, vectors = np.linalg.eigh(self.covariance)
        widest = vectors[:, ::-1][:, :n]
        return widest * np.where(widest.sum(axis=0) < 0.0, -1.0, 1.0)


def free_grasp(grasp: Grasp) -> FreeGrasp:
    """Return a planned grasp as one of the fully actuated hand."""
    return FreeGrasp(
        grasp.joint_angles,
        grasp.palm_pose.homogeneous,
        grasp.problem.synergies.basis @ grasp.delta_sigma,
        grasp.reference_joint_angles,
        grasp.contact_forces,
    )


def scatter_of(grasps: Sequence[FreeGrasp], displacement_scale: float) -> Scatter:
    """Return the scatter of grasps.

    Args:
        grasps: One grasp of every object.
        displacement_scale: Factor that brings displacements to the size of postures.
    """
    references = np.array([grasp.reference for grasp in grasps])
    moved = displacement_scale * np.array([grasp.displacement for grasp in grasps])
    mean = references.mean(axis=0)
    spread = (references - mean).T @ (references - mean)
    return Scatter(mean, (spread + DISPLACEMENT_WEIGHT * moved.T @ moved) / len(grasps))


class SpanDistance(Cost):
    """((q_r − q̄)ᵀ M (q_r − q̄) + w dᵀ M d)/n_q with d the scaled S δσ; for a hand whose S is the identity.

    Where forces come from springs there is no δσ, and references alone count.
    """

    name = "span_distance"

    def __init__(self, mean: Array, metric: Array, displacement_scale: float) -> None:
        self.mean, self.metric, self.displacement_scale = mean, metric, displacement_scale

    def value(self, problem: GraspProblem, state: GraspState) -> float:
        """Return the distance."""
        return self._distance(state.reference, state.delta_sigma)

    def gradient(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its gradient by x."""
        away, moved = state.reference - self.mean, self.displacement_scale * state.delta_sigma
        slope = 2.0 * (self.metric @ away) @ state.d_reference
        if moved.size:
            slope[-len(moved) :] += 2.0 * DISPLACEMENT_WEIGHT * self.displacement_scale * (self.metric @ moved)
        return slope / len(away)

    def clear_value(self, grasp: PosedGrasp) -> float:
        """Return the distance of a grasp that meets its synergies."""
        moved = grasp.delta_sigma if grasp.contact_forces is None else np.zeros(0)
        return self._distance(grasp.reference_joint_angles, moved)

    def _distance(self, reference: Array, delta_sigma: Array) -> float:
        """Return the distance of q_r and δσ."""
        away, moved = reference - self.mean, self.displacement_scale * delta_sigma
        squares = away @ self.metric @ away
        if moved.size:
            squares += DISPLACEMENT_WEIGHT * moved @ self.metric @ moved
        return float(squares / len(away))


def fully_actuated_problem(problem: GraspProblem) -> GraspProblem:
    """Return a problem in which every joint is a synergy of its own."""
    joints = problem.hand.n_joints
    space = SynergySpace(problem.hand.joint_names, problem.synergies.mean, np.eye(joints), name="fully actuated")
    return replace(problem, n_synergies=joints, synergy_space=space)


def displacement_scale(problem: GraspProblem) -> float:
    """Return the factor that brings displacements S δσ to the size of postures."""
    return JOINT_SCALE / displacement_step(problem)


def moved_closer(problem: GraspProblem, grasp: FreeGrasp, scatter: Scatter, epsilon: float) -> FreeGrasp:
    """Move a grasp, within all constraints, to where it is closest to others.

    Args:
        problem: Its problem; the number of synergies does not matter.
        grasp: The grasp.
        scatter: The scatter of all grasps.
        epsilon: Spread added in all directions [rad]; the less it is, the more a direction that none needs costs.

    Returns:
        The moved grasp; where the solver left the constraints, the grasp as it was. Either with its distance.
    """
    free = fully_actuated_problem(problem)
    cost = SpanDistance(scatter.mean, scatter.metric(epsilon), displacement_scale(free))
    weights = replace(free.parameters, force_weight=FORCE_WEIGHT, task_weight=0.0)
    pose = pin.SE3(grasp.palm_pose)
    program = GraspProgram(replace(free, parameters=weights, costs=(cost,)), pose)
    start = program.pack(grasp.joint_angles, pose, grasp.displacement, grasp.contact_forces)

    def distance(z: Array) -> float:
        return program.objective.value(program.problem, program.state(z))

    with threadpool_limits(limits=1):
        z = solve_nlp(program.build("two"), start, max_iterations=MAX_ITERATIONS, tolerance=TOLERANCE).z
    if not np.isfinite(z).all() or program.merit(z) > CLOSE_ENOUGH:
        return replace(grasp, distance=distance(start))
    state, found = program.state(z), program.evaluator
    return FreeGrasp(
        state.x[found.layout.joints],
        found.palm_pose(state.x).homogeneous,
        state.delta_sigma if state.delta_sigma.size else grasp.displacement,
        state.reference,
        found.forces_in_object(state.x),
        distance(z),
    )


def spanning_synergies(joint_names: Sequence[str], scatter: Scatter, others: Array, least: float) -> SynergySpace:
    """Return a full set: the principal directions of the scatter, then those of other postures normal to them.

    Args:
        joint_names: Names of the joints.
        scatter: The scatter of grasps that share a subspace.
        others: Postures whose principal components, normal to the first directions, complete the set, (n, n_q).
        least: Spread from which a direction of the scatter counts [rad].

    Returns:
        The set, S of shape (n_q, n_q); its variances are those of the other postures along the synergies.
    """
    eigenvalues, vectors = np.linalg.eigh(scatter.covariance)
    first = vectors[:, ::-1][:, eigenvalues[::-1] > least**2]
    rest = others - others.mean(axis=0)
    rest = rest - rest @ first @ first.T
    _, _, directions = np.linalg.svd(rest, full_matrices=True)
    basis = np.hstack([first, directions[: len(scatter.mean) - first.shape[1]].T])
    basis, _ = np.linalg.qr(basis)
    basis *= np.where(basis.sum(axis=0) < 0.0, -1.0, 1.0)
    variance = np.var(others @ basis, axis=0, ddof=1)
    return SynergySpace(tuple(joint_names), scatter.mean, basis, variance=variance)
