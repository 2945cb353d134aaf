"""The quasi-static answer of a compliant synergy hand: object, forces, joints, torques, motors, on plain matrices.

Every spring is linear about a grasp: contacts Δf = K_c (J Δq − Gᵀ Δu), joints Δτ = K_q (S Δz − Δq), motors
Δσ = K_z (Δz_r − Δz), with G Δf = −Δw and Δτ = Jᵀ Δf (+ preload terms). Solved as one linear system in compliances, so
that rigid contacts, joints or motors are a matter of a zero. [Prattichizzo2013], [Gabiccini2011].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt
from scipy import linalg

from ..checks import finite_array, positive_definite
from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Array
from ..values import Value

RIGID = None
"""A stiffness that is infinite."""
SINGULAR = 1e-14
"""Reciprocal condition number, rows and columns scaled, from which on the springs do not fix the grasp."""
RANK = 1e-9
"""Singular values below this share of the largest count as zero."""
FreeMotion = Literal["refused", "none"]
"""What is done about motions of the object that no contact resists."""


@dataclass(frozen=True, eq=False, repr=False)
class Preload(Value):
    """Geometric stiffness: how the forces that act already turn with joints and object.

    Attributes:
        joints: ∂(Jᵀ f)/∂q [N m/rad], of shape (n_q, n_q).
        object: ∂(Jᵀ f)/∂u, of shape (n_q, 6).
        synergies: ∂(Sᵀ τ)/∂z [N m/rad], of shape (n_z, n_z).
        wrench: −∂(G f)/∂u, of shape (6, 6): what an object that turns under its forces resists by itself.
    """

    joints: Array | None = None
    object: Array | None = None
    synergies: Array | None = None
    wrench: Array | None = None


@dataclass(frozen=True, eq=False, repr=False)
class CompliantGrasp(Value):
    """A grasp as matrices and springs, whatever made them; n contact components (3 n_c for hard fingers).

    Attributes:
        grasp: G, contact forces to the wrench on the object, of shape (6, n).
        jacobian: J, joint to contact velocities, of shape (n, n_q).
        basis: S, motors to joint references, of shape (n_q, n_z).
        contact_compliance: C_c = K_c⁻¹, of shape (n, n); zero for rigid contacts.
        joint_compliance: C_q = K_q⁻¹, of shape (n_q, n_q).
        synergy_compliance: C_z = K_z⁻¹, of shape (n_z, n_z); zero for motors that hold their position.
        preload: Geometric terms; none by default.
    """

    grasp: Array
    jacobian: Array
    basis: Array
    contact_compliance: Array
    joint_compliance: Array
    synergy_compliance: Array
    preload: Preload = Preload()

    @property
    def stiffness(self) -> Array:
        """K, the springs of contacts, joints and motors in series [N/m], of shape (n, n); without preload.

        K⁻¹ = C_c + J C_q Jᵀ + J S C_z Sᵀ Jᵀ; [Malvezzi2015].

        Raises:
            InvalidValueError: If contacts are rigid in a direction in which no joint gives way.
        """
        moved = self.jacobian @ self.basis
        compliance = self.contact_compliance + self.jacobian @ self.joint_compliance @ self.jacobian.T
        return _solved(compliance + moved @ self.synergy_compliance @ moved.T, np.eye(len(compliance)))


@dataclass(frozen=True, eq=False, repr=False)
class Answer(Value):
    """What a compliant grasp does per unit of k inputs; every map has k columns.

    Attributes:
        object_motion: Δu, the object's twist, of shape (6, k); V of motor references.
        contact_forces: Δf on the object [N], of shape (n, k); P.
        joint_motion: Δq [rad], of shape (n_q, k); Q.
        joint_torques: Δτ [N m], of shape (n_q, k); T.
        synergy_motion: Δz, where the motors end up, of shape (n_z, k); Y.
        motor_forces: Δσ = Sᵀ Δτ, of shape (n_z, k).
    """

    object_motion: Array
    contact_forces: Array
    joint_motion: Array
    joint_torques: Array
    synergy_motion: Array
    motor_forces: Array

    def of(self, inputs: npt.ArrayLike) -> Answer:
        """Return the answer to inputs of shape (k,) or (k, m): an activation."""
        columns = np.asarray(inputs, dtype=float)
        return Answer(*(getattr(self, name) @ columns for name in self.__dataclass_fields__))


@dataclass(frozen=True, eq=False, repr=False)
class QuasiStatic(Value):
    """The two answers of a compliant grasp.

    Attributes:
        commands: To the motors' references z_r: V, P, Q, T, Y.
        wrench: To a wrench Δw on the object, references held.
    """

    commands: Answer
    wrench: Answer


def compliant_grasp(
    grasp: Array,
    jacobian: Array,
    basis: Array,
    *,
    contact_stiffness: npt.ArrayLike | None,
    joint_stiffness: npt.ArrayLike | None,
    synergy_stiffness: npt.ArrayLike | None = RIGID,
    preload: Preload | None = None,
) -> CompliantGrasp:
    """Return a grasp of matrices and stiffnesses, each a number, a diagonal, a full matrix, or None for rigid.

    Args:
        grasp: G, of shape (6, n).
        jacobian: J, of shape (n, n_q).
        basis: S, of shape (n_q, n_z).
        contact_stiffness: K_c [N/m].
        joint_stiffness: K_q [N m/rad].
        synergy_stiffness: K_z [N m/rad].
        preload: Geometric terms.

    Returns:
        The grasp.

    Raises:
        InvalidValueError: If shapes do not fit or a stiffness is not symmetric positive definite.
    """
    grasp, jacobian, basis = (np.atleast_2d(np.asarray(part, dtype=float)) for part in (grasp, jacobian, basis))
    n, n_q = grasp.shape[1], basis.shape[0]
    finite_array("G", grasp, (6, n))
    finite_array("J", jacobian, (n, n_q))
    finite_array("S", basis, (n_q, basis.shape[1]))
    return CompliantGrasp(
        grasp,
        jacobian,
        basis,
        _compliance("contact_stiffness", contact_stiffness, n),
        _compliance("joint_stiffness", joint_stiffness, n_q),
        _compliance("synergy_stiffness", synergy_stiffness, basis.shape[1]),
        preload or Preload(),
    )


def quasi_static_maps(springs: CompliantGrasp, *, free: FreeMotion = "refused") -> QuasiStatic:
    """Return how a compliant grasp answers its motors and a wrench on the object.

    Without preload P = (I − G_K^R G) K J S and V = (G K Gᵀ)⁻¹ G K J S, K the stiffness in series.

    Args:
        springs: The grasp.
        free: What is done about motions u with Gᵀ u = 0, such as a turn about the line of two points: ``refused``; or
            ``none``, the object makes no such motion and of a wrench only the part along the others acts, as if a
            frictionless guide took the rest. Forces, joints and motors do not depend on that motion.

    Returns:
        The maps per unit of reference, and per unit of wrench.

    Raises:
        InvalidValueError: If the springs leave the object free to move (G K Gᵀ singular).
        NameNotFoundError: If there is no such choice.
    """
    if free not in get_args(FreeMotion):
        raise NameNotFoundError("free", str(free), get_args(FreeMotion))
    held = resisted_motions(springs.grasp) if free == "none" else np.eye(6)
    g, j, s = held.T @ springs.grasp, springs.jacobian, springs.basis
    (n, n_q), n_z = j.shape, s.shape[1]
    cuts = np.cumsum([n, n_q, len(g)])
    k_q, k_u, k_z, k_w = _preload(springs.preload, n_q, n_z)
    k_u, k_w = k_u @ held, held.T @ k_w @ held
    # The torques as rows over (Δf, Δq, Δu, Δz).
    torques = np.hstack([j.T, k_q, k_u, np.zeros((n_q, n_z))])
    motors = s.T @ torques
    motors[:, cuts[2] :] += k_z
    size = cuts[2] + n_z
    system = np.zeros((size, size))
    system[:n] = np.hstack([springs.contact_compliance, -j, g.T, np.zeros((n, n_z))])
    system[n : cuts[1]] = springs.joint_compliance @ torques
    system[n : cuts[1], n : cuts[1]] += np.eye(n_q)
    system[n : cuts[1], cuts[2] :] -= s
    system[cuts[1] : cuts[2], :n] = g
    system[cuts[1] : cuts[2], cuts[1] : cuts[2]] = -k_w
    system[cuts[2] :] = springs.synergy_compliance @ motors
    system[cuts[2] :, cuts[2] :] += np.eye(n_z)
    right = np.zeros((size, n_z + 6))
    right[cuts[2] :, :n_z] = np.eye(n_z)
    right[cuts[1] : cuts[2], n_z:] = -held.T
    found = _solved(system, right)
    forces, joints, twist, synergies = np.split(found, cuts)
    parts = (held @ twist, forces, joints, torques @ found, synergies, motors @ found)
    return QuasiStatic(Answer(*(part[:, :n_z] for part in parts)), Answer(*(part[:, n_z:] for part in parts)))


def resisted_motions(grasp: Array) -> Array:
    """Return an orthonormal basis of the range of G: twists that move a contact, wrenches that contacts can exert.

    Args:
        grasp: G, of shape (6, n).

    Returns:
        The basis, of shape (6, rank G); the identity where the rank is 6.
    """
    left, values, _ = np.linalg.svd(grasp)
    rank = int((values > RANK * max(float(values.max(initial=0.0)), 1e-300)).sum())
    return np.eye(6) if rank == 6 else np.asarray(left[:, :rank])


def _solved(system: Array, right: Array) -> Array:
    """Solve a linear system, its rows and columns scaled to size one."""
    rows = 1.0 / np.maximum(np.abs(system).max(axis=1), 1e-300)
    columns = 1.0 / np.maximum((rows[:, None] * np.abs(system)).max(axis=0), 1e-300)
    scaled = rows[:, None] * system * columns
    values = np.linalg.svd(scaled, compute_uv=False)
    if values[-1] <= SINGULAR * values[0]:
        raise InvalidValueError("grasp", f"rank {int((values > SINGULAR * values[0]).sum())}", "springs that fix it")
    return np.asarray(columns[:, None] * linalg.solve(scaled, rows[:, None] * right))


def _preload(preload: Preload, n_q: int, n_z: int) -> tuple[Array, Array, Array, Array]:
    """Return the geometric terms, checked, zero where there are none."""
    shapes = {"joints": (n_q, n_q), "object": (n_q, 6), "synergies": (n_z, n_z), "wrench": (6, 6)}
    terms = []
    for name, shape in shapes.items():
        given = getattr(preload, name)
        terms.append(np.zeros(shape) if given is None else finite_array(f"preload {name}", given, shape))
    return terms[0], terms[1], terms[2], terms[3]


def _compliance(field: str, stiffness: npt.ArrayLike | None, size: int) -> Array:
    """Return the inverse of a stiffness that is a number, a diagonal, a full matrix or rigid."""
    if stiffness is RIGID:
        return np.zeros((size, size))
    given = np.asarray(stiffness, dtype=float)
    if given.ndim < 2:
        given = np.diag(finite_array(field, np.broadcast_to(given, (size,)) if given.ndim == 0 else given, (size,)))
    return np.asarray(linalg.inv(positive_definite(field, given, size)))
