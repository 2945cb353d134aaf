"""Stability: the stiffness with which a grasp holds the object, preload included.

The palm and the references q_r are held (of tendons the lengths); the object moves by a small twist ν = (v, ω), and
the contacts do not slip. Assumptions, contact by contact, written in the object's frame:

* The contact is an isotropic spring K_c between the point of the finger and the point of the object that touch:
  δf = K_c δx for their relative displacement δx = J δq − Gᵀ ν.
* A soft finger also turns about its normal, against a² K_c, and its moment m n turns with the normal. A frictionless
  fingertip slides: f = f_n n acts through its centre p, δf = K_c n nᵀ δp − f_n H δp.
* A fingertip of radius r rolls without slip on the object: with the relative rotation ω_r of the finger its contact
  moves by δc = (I − r H) r n × ω_r along both surfaces, the normal by δn = −H r n × ω_r (H the curvature of the
  object's distance at the tip's centre), and the force turns with the normal: δf += (n × δn) × f. A point fingertip
  does not roll.

The preload adds what the forces do by moving with their points and turning with the object; with the hand,
δτ = Jᵀ δf + (∂Jᵀ/∂q f) δq + …, the joints yield by δq = −C_q δτ. Eliminating δq leaves the wrench on the object,
δw = −S ν. Without preload S = G K Gᵀ. The ingredients are those of Cutkosky and Kao, "Computing and Controlling
the Compliance of a Robotic Hand", IEEE Trans. Robotics and Automation 5(2), 1989, and Howard and Kumar, "On the
Stability of Grasped Objects", IEEE Trans. Robotics and Automation 12(6), 1996.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..hand.kinematics import ContactKinematics, HandKinematics
from ..model.compliance import bent, series_stiffness, softened
from ..model.contacts import Contacts
from ..problem.problem import GraspProblem
from ..problem.tendon_drive import passive_compliance
from ..spatial import Array, Pose, readonly, skew
from ..values import Value, number_text


@dataclass(frozen=True, eq=False, repr=False)
class Stability(Value):
    """How stiffly the object is held. Twists in O: translation of the centre, rotation.

    Attributes:
        stiffness: S with δw = −S ν, the wrench about the moving centre, of shape (6, 6) [N/m, N/rad, N, N m/rad].
        smallest: Smallest eigenvalue of the symmetric part with rotations measured as lengths at L [N/m].
        direction: Its unit eigenvector (v, L ω), of shape (6,): the motion the grasp resists least.
        without_preload: Smallest eigenvalue of G K Gᵀ in the same measure [N/m].
        finger_stiffness: Smallest eigenvalue of I + √C_q (∂τ/∂q) √C_q: of the fingers with the object held, 1 for
            free joints; not positive if a finger buckles under its load.
        length: L [m].
    """

    stiffness: Array
    smallest: float
    direction: Array
    without_preload: float
    finger_stiffness: float
    length: float

    @property
    def stable(self) -> bool:
        """Whether the object returns from any small motion and no finger buckles."""
        return self.smallest > 0.0 and self.finger_stiffness > 0.0

    @property
    def text(self) -> str:
        """One line: the verdict and the motion that is resisted least."""
        shift, turn = self.direction[:3], self.direction[3:]
        moved, turned = float(np.linalg.norm(shift)), float(np.linalg.norm(turn))
        kind, part, size = ("shift along", shift, moved) if moved >= turned else ("turn about", turn, turned)
        axis = " ".join(f"{value:+.2f}" for value in part / size + 0.0)
        verdict = "stable" if self.stable else "UNSTABLE"
        if self.smallest > 0.0 and not self.stable:
            return f"{verdict}: a finger buckles under its load"
        return f"{verdict}: least stiffness {number_text(self.smallest)} N/m, mostly a {kind} ({axis})"


def grasp_stability(
    problem: GraspProblem, q: Array, palm_in_object: Pose, contacts: Contacts, intensities: Array
) -> Stability:
    """Return the stiffness of a grasp with its preload.

    Args:
        problem: The problem; its contact stiffness has to be positive.
        q: Joint angles [rad], of shape (n_q,).
        palm_in_object: Pose of the palm frame in O.
        contacts: The contacts.
        intensities: λ, for hard fingers f [N], of shape (n_c, d).

    Returns:
        The stability; without contact stiffness nothing is stiff.
    """
    model = problem.contact_model
    forces, moments = model.forces(intensities, contacts.normals), model.moments(intensities, contacts.normals)
    motion = _Motion.at(problem, q, palm_in_object, contacts, intensities)
    c_q = passive_compliance(problem)
    d_torque_q, d_torque_nu = motion.torques(forces, moments)
    yielding = -np.linalg.solve(np.eye(len(c_q)) + bent(c_q, d_torque_q), bent(c_q, d_torque_nu))
    by_q, by_nu = motion.wrench(forces, moments)
    stiffness = -(by_nu + by_q @ yielding)

    length = problem.grasp_object.length_scale
    scale = np.repeat([1.0, 1.0 / length], 3)
    values, vectors = _symmetric(scale[:, None] * stiffness * scale)
    grasp = model.grasp_matrix(contacts.points, contacts.normals)
    passive = np.zeros((6, 6))
    if problem.parameters.contact_stiffness > 0.0:
        twists = np.concatenate([motion.touching, motion.angular], axis=1)
        series = series_stiffness(model.hand_jacobian(twists, contacts.normals), c_q, problem.contact_springs)
        passive = grasp @ series @ grasp.T
    root = _root(c_q)
    return Stability(
        stiffness=readonly(stiffness),
        smallest=float(values[0]),
        direction=readonly(vectors[:, 0]),
        without_preload=float(_symmetric(scale[:, None] * passive * scale)[0][0]),
        finger_stiffness=float(_symmetric(np.eye(len(c_q)) + softened(bent(root, d_torque_q), root))[0][0]),
        length=length,
    )


def _root(compliance: Array) -> Array:
    """Return √C_q, of a diagonal its diagonal."""
    if compliance.ndim == 1:
        return np.sqrt(compliance)
    values, vectors = _symmetric(compliance)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def joint_preload(
    problem: GraspProblem, q: Array, palm_in_object: Pose, contacts: Contacts, intensities: Array
) -> Array:
    """Return ∂(Jᵀ λ)/∂q [N m/rad] with constant forces at points that are fixed on their links, of shape (n_q, n_q)."""
    return _Motion.at(problem, q, palm_in_object, contacts, intensities).preload


def _symmetric(matrix: Array) -> tuple[Array, Array]:
    """Return eigenvalues, smallest first, and eigenvectors of the symmetric part of a matrix."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return values, vectors


@dataclass(frozen=True)
class _Motion:
    """How contacts move in O with (δq, ν): pairs of maps, by δq of shape (n_c, 3, n_q), by ν of shape (n_c, 3, 6)."""

    jacobian: Array
    touching: Array
    angular: Array
    preload: Array
    points: Array
    displaced: tuple[Array, Array]
    rolled: tuple[Array, Array]
    force: tuple[Array, Array]
    moment: tuple[Array, Array]

    @classmethod
    def at(
        cls,
        problem: GraspProblem,
        q: Array,
        palm_in_object: Pose,
        contacts: Contacts,
        intensities: Array,
    ) -> _Motion:
        """Return the motion of the contacts of a grasp, those of frictionless ones at the centres of the tips."""
        rotation = np.array(palm_in_object.rotation)
        found = HandKinematics(problem.hand, problem.frames).compute(q, angular=True, derivatives=True)
        normals, model = contacts.normals, problem.contact_model
        forces, moments = model.forces(intensities, normals), model.moments(intensities, normals)
        angular, arm = rotation @ found.angular, problem.radii[:, None] * normals
        touching = rotation @ found.linear - skew(arm) @ angular
        surface = problem.grasp_object.sample(contacts.points - arm)
        radii, points = problem.radii[:, None, None], contacts.points
        if not model.has_friction:
            radii, points, arm = np.zeros_like(radii), points - arm, np.zeros_like(arm)
        material = rotation @ found.linear - skew(arm) @ angular  # J
        bend = surface.hessian / np.linalg.norm(surface.gradient, axis=1)[:, None, None]
        bend = bend - normals[:, :, None] * (normals[:, None, :] @ bend)  # H
        rolling = radii * skew(normals)  # of the tip's centre, per relative rotation
        with_normal = skew(normals) @ (-bend @ rolling)  # n × δn
        turning = -skew(forces) @ with_normal  # of the force with it
        held, slope = model.basis(normals)[:, 3:], model.basis_slope(normals)[:, 3:]
        spinning = np.einsum("cidk,cd->cik", slope, intensities) @ (-bend @ rolling)  # of the moment with it
        upon = rolling - radii * (bend @ rolling)
        n_c = len(points)
        still = np.zeros((n_c, 3, 6))
        by_nu = still.copy()
        by_nu[:, :, :3], by_nu[:, :, 3:] = -np.eye(3), skew(points)
        turn_nu = still.copy()
        turn_nu[:, :, 3:] = -np.eye(3)
        k_c = problem.parameters.contact_stiffness
        stiff: float | Array = k_c
        outer = normals[:, :, None] * normals[:, None, :]
        if not model.has_friction:
            stiff = k_c * outer - np.einsum("ij,ij->i", forces, normals)[:, None, None] * bend
        spinning = spinning + k_c * (held * model.stiffness_factors) @ held.transpose(0, 2, 1)
        # ∂(Jᵀ f)/∂q with the touching points fixed on their links.
        second = _material_derivative(found, rotation, arm)
        preload = np.einsum("ij,kijl->lk", forces, second)
        preload += np.einsum("ij,kijl->lk", moments, rotation @ found.angular_derivative)
        return cls(
            jacobian=material.reshape(3 * n_c, -1),
            touching=touching,
            angular=angular,
            preload=preload,
            points=points,
            displaced=(material, by_nu),
            rolled=(upon @ angular, upon @ turn_nu),
            force=(_times(stiff, material) + turning @ angular, _times(stiff, by_nu) + turning @ turn_nu),
            moment=(spinning @ angular, spinning @ turn_nu),
        )

    def wrench(self, forces: Array, moments: Array) -> tuple[Array, Array]:
        """Return ∂(F, M) by q and by ν: in space, about the moving centre; of shapes (6, n_q) and (6, 6)."""
        parts = []
        maps = zip(self.force, self.moment, self.displaced, self.rolled, strict=True)
        for d_force, d_moment, displaced, rolled in maps:
            moment = skew(self.points) @ d_force - skew(forces) @ (displaced + rolled) + d_moment
            parts.append(np.vstack([d_force.sum(axis=0), moment.sum(axis=0)]))
        by_q, by_nu = parts
        # Seen from space the wrench turns with the object.
        by_nu[:3, 3:] -= skew(forces.sum(axis=0))
        by_nu[3:, 3:] -= skew((np.cross(self.points, forces) + moments).sum(axis=0))
        return by_q, by_nu

    def torques(self, forces: Array, moments: Array) -> tuple[Array, Array]:
        """Return ∂τ by q and by ν, τ = Jᵀ f of the moving forces and moments; of shapes (n_q, n_q) and (n_q, 6)."""
        parts = []
        for d_force, d_moment, rolled in zip(self.force, self.moment, self.rolled, strict=True):
            lever = np.einsum("ijq,ijk->qk", self.angular, -skew(forces) @ rolled + d_moment)
            parts.append(self.jacobian.T @ d_force.reshape(len(self.jacobian), -1) + lever)
        by_q, by_nu = parts
        turned = -skew(forces).reshape(len(self.jacobian), 3)  # ω × f
        by_nu[:, 3:] += self.jacobian.T @ turned
        by_nu[:, 3:] += np.einsum("ijq,ijk->qk", self.angular, -skew(moments))  # ω × m
        return by_q + self.preload, by_nu


def _times(stiffness: float | Array, motion: Array) -> Array:
    """Return a stiffness, or one matrix a contact, times a motion."""
    return stiffness * motion if isinstance(stiffness, float) else stiffness @ motion


def _material_derivative(found: ContactKinematics, rotation: Array, arm: Array) -> Array:
    """Return ∂J/∂q_k in O of points fixed on their links.

    Args:
        found: Kinematics in P.
        rotation: Rotation of P in O.
        arm: From the contact frames' points to those points in O [m], of shape (n_c, 3).

    Returns:
        The derivatives, k first, of shape (n_q, n_c, 3, n_q).
    """
    angular = rotation @ found.angular
    turned = skew(np.cross(angular.transpose(2, 0, 1), arm))  # of the arm with joint k
    linear, spin = rotation @ found.linear_derivative, rotation @ found.angular_derivative
    return linear - turned @ angular - skew(arm) @ spin
