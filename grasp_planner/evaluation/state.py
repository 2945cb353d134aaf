"""The grasp at one point of the search: every quantity of the model and its derivatives, evaluated once.

Forces follow from δσ by eq. (17), or are variables of their own that springs and equilibrium alone bind. The implicit
posture (10) becomes the compliance equation S_⊥ᵀ (q − q̄ + C_q τ) = 0, of n_q − n_s rows. This is the fast form; its
oracle are the one-formula functions of contacts, compliance, friction and task.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..model.compliance import bent
from ..problem.problem import GraspProblem
from ..spatial import Array
from .clearance import ClearanceState
from .contact_geometry import ContactGeometry
from .force_distribution import ForceDistribution
from .free_forces import FreeForces, turned_intensities
from .load_response import LoadEvaluator, LoadState
from .posed_hand import PosedHandEvaluator
from .variables import VariableLayout

FRICTION_SMOOTHING = 1e-3
"""ε in √(|f_t|² + ε²), a smooth and conservative length of the tangential force [N]."""

FORCE_SMOOTHING = 1e-9
"""Added under the root of F, so that its gradient exists without load [N]."""


@dataclass(frozen=True)
class GraspState:
    """All quantities of the model at one x, in O; n_c contacts. Derivatives have x, of size n_x, as last axis.

    Attributes:
        x: The variables.
        geometry: Contact points, normals, gaps, G, J.
        delta_sigma: δσ [rad], of shape (n_s,); (0,) where forces come from springs.
        intensities: Intensities λ of the contacts, for hard fingers their forces [N], of shape (n_c, d).
        balance: G λ + w_ext [N, N m], of shape (6,); (0,) by (17), whose forces balance the load by construction.
        normal_forces: f_n [N], of shape (n_c,).
        friction_margins: μ f_n − √(|λ − f_n ν|² + ε²), for hard fingers μ f_n − √(|f_t|² + ε²) [N], of shape (n_c,).
        torques: Joint torques that bend the joints in (10), by the chosen torque model [N m], of shape (n_q,).
        reference: q_r = q + C_q τ [rad], the posture the motors ask for, of shape (n_q,).
        compliance: S_⊥ᵀ (q_r − q̄) [rad], of shape (n_q − n_s,).
        force_norm: F [N].
        task_index: C.
        d_gaps: ∂gaps/∂x, of shape (n_c, n_x).
        d_intensities: ∂λ/∂x, of shape (d n_c, n_x).
        d_balance: ∂balance/∂x, of shape (6 or 0, n_x).
        d_normal_forces: ∂f_n/∂x, of shape (n_c, n_x).
        d_friction_margins: ∂friction_margins/∂x, of shape (n_c, n_x).
        d_reference: ∂q_r/∂x, of shape (n_q, n_x).
        d_compliance: ∂compliance/∂x, of shape (n_q − n_s, n_x).
        d_force_norm: ∂F/∂x, of shape (n_x,).
        d_task_index: ∂C/∂x, of shape (n_x,).
        clearance: Clearances of the hand; None if the problem asks for none.
        loads: What load cases leave of the limits; None if the problem has none.
    """

    x: Array
    geometry: ContactGeometry
    delta_sigma: Array
    intensities: Array
    balance: Array
    normal_forces: Array
    friction_margins: Array
    torques: Array
    reference: Array
    compliance: Array
    force_norm: float
    task_index: float
    d_gaps: Array
    d_intensities: Array
    d_balance: Array
    d_normal_forces: Array
    d_friction_margins: Array
    d_reference: Array
    d_compliance: Array
    d_force_norm: Array
    d_task_index: Array
    clearance: ClearanceState | None
    loads: LoadState | None

    @property
    def forces(self) -> Array:
        """Contact forces f of the hand on the object [N], of shape (n_c, 3)."""
        return self._forces[0]

    @property
    def d_forces(self) -> Array:
        """∂f/∂x, of shape (3 n_c, n_x)."""
        return self._forces[1]

    @property
    def _forces(self) -> tuple[Array, Array]:
        """The contact forces and their derivatives."""
        held = self.geometry.held
        return (
            (self.intensities, self.d_intensities)
            if held is None
            else held.forces(self.intensities, self.d_intensities)
        )


class StateEvaluator:
    """Evaluates a problem at points x around a reference pose of the palm.

    Keeps what is constant and a Pinocchio workspace; not for use from several threads at once.
    """

    def __init__(self, problem: GraspProblem, reference_pose: pin.SE3, like: StateEvaluator | None = None) -> None:
        """Make an evaluator; what it may share with another one it takes from there."""
        self.problem = problem
        self.layout = VariableLayout.of(problem)
        shared: PosedHandEvaluator | None = None if like is None else like._posed
        self._posed: PosedHandEvaluator = PosedHandEvaluator.of(problem, reference_pose, shared)
        self.chart = self._posed.chart
        self._loads = LoadEvaluator(problem) if problem.loads.active else None
        self._complement = problem.synergies.complement()

    def pack(self, q: Array, pose: pin.SE3, delta_sigma: Array, contact_forces: Array | None = None) -> Array:
        """Return x of a posture [rad], a palm pose in O and what makes the forces.

        Args:
            q: Joint angles [rad], of shape (n_q,).
            pose: Pose of the palm in O.
            delta_sigma: δσ [rad], of shape (n_s,); not used where forces come from springs.
            contact_forces: λ in O [N], of shape (n_c, d), where they do; none if left out.
        """
        w = self.chart.coordinates(pose)
        if not self.layout.n_forces:
            return np.concatenate([q, w, delta_sigma])
        if contact_forces is None:
            return np.concatenate([q, w, np.zeros(self.layout.n_forces)])
        return np.concatenate([q, w, turned_intensities(contact_forces, np.array(pose.rotation).T).ravel()])

    def forces_in_object(self, x: Array) -> Array | None:
        """Return the intensities at x in O [N], of shape (n_c, d); None where δσ makes them, eq. (17)."""
        if not self.layout.n_forces:
            return None
        rotation, _ = self.chart.pose(x[self.layout.pose])
        return turned_intensities(x[self.layout.forces].reshape(len(self.problem.frames), -1), rotation)

    def palm_pose(self, x: Array) -> pin.SE3:
        """Return the pose of the palm frame in O at x."""
        return pin.SE3(*self.chart.pose(x[self.layout.pose]))

    def synergy_distance(self, x: Array) -> tuple[Array, Array]:
        """Return S_⊥ᵀ (q − q̄) [rad], what the synergies alone can't give, and its derivatives by x."""
        joints = self.layout.joints
        derivative = np.zeros((self._complement.shape[1], self.layout.size))
        derivative[:, joints] = self._complement.T
        return self._complement.T @ (x[joints] - self.problem.synergies.mean), derivative

    def evaluate(self, x: Array) -> GraspState:
        """Evaluate everything at x.

        Args:
            x: The variables, of shape (n_x,).

        Returns:
            The state with all derivatives.
        """
        problem, layout = self.problem, self.layout
        q, delta_sigma = x[layout.joints], x[layout.displacement]
        geometry, clearance = self._posed.evaluate(x)
        distribution: ForceDistribution | FreeForces
        if layout.n_forces:
            distribution = FreeForces(problem, geometry, layout, x)
        else:
            distribution = ForceDistribution(problem, geometry, delta_sigma)
        forces, d_forces = distribution.forces(problem.external_wrench)
        balance, d_balance = distribution.balance(problem.external_wrench)
        bending = (forces, d_forces)
        if problem.parameters.torque_model == "internal":
            bending = distribution.forces(np.zeros(6))
        torques, d_torques = distribution.torques(*bending)
        loads = None
        if self._loads is not None:
            total = (torques, d_torques) if bending[0] is forces else distribution.torques(forces, d_forces)
            loads = self._loads.evaluate(geometry, (forces, d_forces), total)
        bending_angles, d_reference = (bent(problem.joint_compliance, each) for each in (torques, d_torques))
        d_reference[:, layout.joints] += np.eye(layout.n_joints)

        by_contact = forces.reshape(geometry.covectors.shape)
        normal, d_normal = _normal_forces(by_contact, d_forces, geometry)
        margins, d_margins = _friction_margins(by_contact, d_forces, normal, d_normal, geometry, problem.friction)
        force_norm = float(np.sqrt(normal @ normal + FORCE_SMOOTHING**2))
        task_index, d_task_index = self._task_index(geometry, distribution.synergy_jacobian)
        return GraspState(
            x=x,
            geometry=geometry,
            delta_sigma=delta_sigma,
            intensities=by_contact,
            balance=balance,
            normal_forces=normal,
            friction_margins=margins,
            torques=torques,
            reference=q + bending_angles,
            compliance=self._complement.T @ (q - problem.synergies.mean + bending_angles),
            force_norm=force_norm,
            task_index=task_index,
            d_gaps=self._pad(geometry.d_gaps),
            d_intensities=d_forces,
            d_balance=d_balance,
            d_normal_forces=d_normal,
            d_friction_margins=d_margins,
            d_reference=d_reference,
            d_compliance=self._complement.T @ d_reference,
            d_force_norm=(normal / force_norm) @ d_normal,
            d_task_index=self._pad(d_task_index),
            clearance=clearance,
            loads=loads,
        )

    def _pad(self, derivative: Array) -> Array:
        """Append zero columns for δσ."""
        padded = np.zeros((*derivative.shape[:-1], self.layout.size))
        padded[..., : self.layout.n_geometric] = derivative
        return padded

    def _task_index(self, geometry: ContactGeometry, synergy_jacobian: Array) -> tuple[float, Array]:
        """Return C of eq. (28) and its gradient by (q, w); α⁻² = ‖H_sᵀ d‖², β⁻² = dᵀ (H_s H_sᵀ)⁻¹ d."""
        grasp = geometry.grasp
        gram_inverse = np.linalg.inv(grasp @ grasp.T)
        total, gradient = 0.0, np.zeros(self.layout.n_geometric)
        for task in self.problem.tasks:
            if task.is_motion:
                # With ξ = (H_s H_sᵀ)⁻¹ d: β⁻² = dᵀ ξ and its gradient is minus that of ‖H_sᵀ ξ‖² at fixed ξ.
                h_s = gram_inverse @ (grasp @ synergy_jacobian)
                covector = np.linalg.solve(h_s @ h_s.T, task.direction)
                _, slope = self._squared_synergy_force(covector, geometry, gram_inverse, synergy_jacobian)
                value, slope = float(task.direction @ covector), -slope
            else:
                value, slope = self._squared_synergy_force(task.direction, geometry, gram_inverse, synergy_jacobian)
            total += task.weight * value
            gradient += task.weight * slope
        return total, gradient

    def _squared_synergy_force(
        self, wrench: Array, geometry: ContactGeometry, gram_inverse: Array, synergy_jacobian: Array
    ) -> tuple[float, Array]:
        """Return ‖H_sᵀ d‖² and its gradient by (q, w) at fixed d."""
        grasp = geometry.grasp
        mu = gram_inverse @ wrench  # μ_d = (G Gᵀ)⁻¹ d
        spread = grasp.T @ mu  # Gᵀ μ_d
        synergy_force = synergy_jacobian.T @ spread  # t = H_sᵀ d
        # Half the gradient is (Gᵀ μ_d)ᵀ dJ S t + (J S t)ᵀ d(Gᵀ μ_d).
        pull = synergy_jacobian @ synergy_force
        half = (geometry.d_jacobian @ (self.problem.synergies.basis @ synergy_force)) @ spread
        d_transpose, d_grasp = geometry.grasp_products(mu, spread)
        settled = gram_inverse @ (grasp @ pull)
        half += pull @ d_transpose - settled @ (d_grasp + grasp @ d_transpose)
        return float(synergy_force @ synergy_force), 2.0 * half


def _normal_forces(forces: Array, d_forces: Array, geometry: ContactGeometry) -> tuple[Array, Array]:
    """Return f_n = ν·λ of each contact and its derivatives by x."""
    normal = np.einsum("ij,ij->i", forces, geometry.covectors)
    d_normal = (geometry.covectors[:, None, :] @ d_forces.reshape(*forces.shape, -1))[:, 0]
    d_normal[:, : geometry.d_covectors.shape[2]] += (forces[:, None, :] @ geometry.d_covectors)[:, 0]
    return normal, d_normal


def _friction_margins(
    forces: Array, d_forces: Array, normal: Array, d_normal: Array, geometry: ContactGeometry, friction: Array
) -> tuple[Array, Array]:
    """Return the smooth margins of eq. (30) and their derivatives by x."""
    tangential = forces - normal[:, None] * geometry.covectors
    length = np.sqrt(np.einsum("ij,ij->i", tangential, tangential) + FRICTION_SMOOTHING**2)
    # |f_t|² = |f|² − f_n², hence |f_t| d|f_t| = f·df − f_n df_n.
    d_squared = (forces[:, None, :] @ d_forces.reshape(*forces.shape, -1))[:, 0] - normal[:, None] * d_normal
    return friction * normal - length, friction[:, None] * d_normal - d_squared / length[:, None]
