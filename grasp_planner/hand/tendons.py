"""Motors that pull by force: tendons over the joints of a hand, and the soft synergies they are.

With moment arms R, springs E = C_q⁻¹ and tensions t the joints rest where E (q − q₀) = Rᵀ t − Jᵀ f, that is
q = q₀ + C_q Rᵀ t − C_q Jᵀ f: equations (4) and (10) of [Mavrogiannis2014] with q̄ = q₀ and S the columns of C_q Rᵀ,
scaled to length one, so that σ is the tension in that scale. These are the adaptive synergies of [Catalano2014].
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog

from ..exceptions import InvalidValueError
from ..spatial import Array, readonly
from ..synergies.space import SynergySpace
from ..values import Value
from .description import TendonsDescription

TENDONS = "tendons"
"""Name of the synergy set that a hand with tendons has."""
LIMIT_ROUNDING = 1e-9
"""How far a free posture may be beyond a joint limit by rounding [rad]."""


@dataclass(frozen=True, eq=False, repr=False)
class Tendons(Value):
    """The tendons of a hand, or other motors that act by force.

    Attributes:
        names: Their names.
        arms: R, moment arms [m], of a motor that turns a joint itself its transmission [1], of shape (n_t, n_q).
        rest: Posture q₀ without tension [rad], of shape (n_q,).
        least: Least tensions [N], 0 for tendons, of shape (n_t,).
        largest: Largest tensions [N], infinite without a limit, of shape (n_t,).
        held: Whether the motors hold their lengths against a disturbance, and not their tensions.
    """

    names: tuple[str, ...]
    arms: Array
    rest: Array
    least: Array
    largest: Array
    held: bool = True

    def first(self, n: int) -> Tendons:
        """Return the first n tendons; the others are slack."""
        return replace(self, names=self.names[:n], arms=self.arms[:n], least=self.least[:n], largest=self.largest[:n])

    def bending(self, compliance: Array) -> Array:
        """Return C_q Rᵀ, the angles by which unit tensions bend the free hand [rad/N], of shape (n_q, n_t).

        Args:
            compliance: C_q [rad/(N m)], a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).
        """
        return compliance @ self.arms.T if compliance.ndim == 2 else compliance[:, None] * self.arms.T

    def scales(self, compliance: Array) -> Array:
        """Return |C_q R_kᵀ| = σ_k/t_k [rad/N], of shape (n_t,).

        Raises:
            InvalidValueError: If a tendon passes rigid joints only.
        """
        found = np.linalg.norm(self.bending(compliance), axis=0)
        if not (found > 0.0).all():
            raise InvalidValueError("joint_compliance", compliance.tolist(), "> 0 for some joint of every tendon")
        return found

    def synergies(self, joints: tuple[str, ...], compliance: Array) -> SynergySpace:
        """Return the soft synergies that the tendons are.

        Args:
            joints: Names of the joints.
            compliance: C_q [rad/(N m)], of shape (n_q,) or (n_q, n_q).

        Returns:
            One synergy a tendon.
        """
        basis = self.bending(compliance) / self.scales(compliance)
        return SynergySpace(joints, self.rest, readonly(basis), name=TENDONS, provenance="columns of C_q R^T")


def described_tendons(
    field: str,
    described: TendonsDescription,
    joints: tuple[str, ...],
    arms: Array,
    rest: Array,
    limits: tuple[Array, Array],
    compliance: Array,
) -> Tendons:
    """Return the tendons of a description, checked.

    Args:
        field: Name used in errors.
        described: The description.
        joints: Names of the joints.
        arms: R, a row for each of its motors, of shape (n_t, n_q).
        rest: Posture without tension [rad], of shape (n_q,).
        limits: Joint limits [rad], each of shape (n_q,).
        compliance: C_q [rad/(N m)], of shape (n_q,) or (n_q, n_q).

    Raises:
        InvalidValueError: If moment arms are linearly dependent, or if no tensions within their limits bend the free
            hand to a posture within its joint limits.
    """
    motors = described.motors
    if np.linalg.matrix_rank(arms) < len(arms):
        raise InvalidValueError(field, list(motors), "tendons whose moment arms are linearly independent")
    largest = np.array([np.inf if motor.limit is None else motor.limit for motor in motors.values()])
    two_way = np.array([motor.two_way for motor in motors.values()])
    found = Tendons(
        names=tuple(motors),
        arms=readonly(arms),
        rest=readonly(rest),
        least=readonly(np.where(two_way, -largest, 0.0)),
        largest=readonly(largest),
        held=described.hold == "length",
    )
    bending = found.bending(compliance)
    room = np.concatenate([limits[1] - rest, rest - limits[0]]) + LIMIT_ROUNDING
    bounds = np.column_stack([found.least, found.largest])
    if not linprog(np.zeros(len(arms)), A_ub=np.vstack([bending, -bending]), b_ub=room, bounds=bounds).success:
        outside = room.reshape(2, -1).min(axis=0) < 0.0
        beyond = {name: angle for name, angle, out in zip(joints, rest.tolist(), outside, strict=True) if out}
        allowed = "a rest from which tensions within their limits bend the free hand to a posture within joint limits"
        raise InvalidValueError(f"rest of {field}", beyond, allowed)
    return found
