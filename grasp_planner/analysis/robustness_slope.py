"""Gradients of PCR and PGR by the matrices and normals of a grasp.

At the least of V over the commanded forces, what the motors still could change changes nothing, so dV follows from
how the springs' forces move at fixed motors. With A = K⁻¹ and B = J S they are A f + Gᵀ u = B z, G f = −w; the adjoint
A p + Gᵀ v = ∂V/∂f, G p = 0 gives dV = pᵀ (dB z − dA f − dGᵀ u) − vᵀ dG f. PGR has the gradient of its best state: where
two states are equally good, and where the number of commanded forces changes, there is none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..exceptions import InvalidValueError
from ..model.compliance import weighted_right_inverse
from ..model.quasi_static import CompliantGrasp
from ..spatial import Array
from ..values import Value
from .friction_cost import ContactLimits, contact_cost
from .robustness import Robustness, counted_limits, kept_directions, reduced_springs


@dataclass(frozen=True, eq=False, repr=False)
class RobustnessGradient(Value):
    """The gradient of n/V within one state of the contacts.

    Attributes:
        by_grasp: ∂/∂G, of shape (6, d n_c).
        by_jacobian: ∂/∂J, of shape (d n_c, n_q).
        by_normals: ∂/∂normals with G and J held, of shape (n_c, d); for other contacts than hard fingers by ν.
    """

    by_grasp: Array
    by_jacobian: Array
    by_normals: Array


def robustness_gradient(
    springs: CompliantGrasp,
    normals: Array,
    limits: ContactLimits,
    found: Robustness,
    wrench: npt.ArrayLike = (0.0,) * 6,
) -> RobustnessGradient:
    """Return the gradient of PCR or PGR in the state that was found.

    Args:
        springs: The grasp.
        normals: Unit normals into the object, of shape (n_c, 3).
        limits: What the contacts bear.
        found: PCR, PGR or the robustness of a state there, without ``directions``.
        wrench: w_ext on the object [N, N m].

    Returns:
        The gradient.

    Raises:
        InvalidValueError: If no forces hold the object, where the robustness is 0.
    """
    if found.value <= 0.0:
        raise InvalidValueError("robustness", found.value, "more than 0, for a gradient")
    kept = kept_directions(normals, found.states)
    part = reduced_springs(springs, kept)
    force, w = kept.T @ found.forces.ravel(), np.asarray(wrench, dtype=float)
    cost = contact_cost(found.forces, normals, limits, counted_limits(found.states))
    slope = kept.T @ cost.gradient
    stiffness = part.stiffness
    inverse = weighted_right_inverse(part.grasp, stiffness)  # K Gᵀ (G K Gᵀ)⁻¹
    moved = part.jacobian @ part.basis
    commands = stiffness @ moved - inverse @ (part.grasp @ stiffness @ moved)
    motors = np.linalg.lstsq(commands, force + inverse @ w, rcond=1e-9)[0]
    # A f + Gᵀ u = B z and A p + Gᵀ v = ∂V/∂f, each weighted with K and seen through G.
    motion = inverse.T @ (moved @ motors - np.linalg.lstsq(stiffness, force, rcond=None)[0])
    turned = inverse.T @ slope
    adjoint = stiffness @ (slope - part.grasp.T @ turned)
    given = part.basis @ (motors - part.synergy_compliance @ (moved.T @ force))
    given = given - part.joint_compliance @ (part.jacobian.T @ force)
    by_grasp = -np.outer(motion, adjoint) - np.outer(turned, force)
    by_jacobian = np.outer(adjoint, given) - np.outer(force, part.joint_compliance @ (part.jacobian.T @ adjoint))
    soft = springs.contact_compliance @ kept
    by_kept = springs.grasp.T @ by_grasp + springs.jacobian @ by_jacobian.T + np.outer(cost.gradient, force)
    by_kept -= np.outer(soft @ force, adjoint) + np.outer(soft @ adjoint, force)
    factor = -found.value / cost.value
    return RobustnessGradient(
        factor * by_grasp @ kept.T,
        factor * kept @ by_jacobian,
        factor * (cost.by_normals + _of_sliding(found, by_kept, np.shape(normals))),
    )


def _of_sliding(found: Robustness, by_kept: Array, shape: tuple[int, ...]) -> Array:
    """Return what of ∂V by the kept directions is by normals: those of sliding contacts."""
    gradient, column = np.zeros(shape), 0
    for i, state in enumerate(found.states):
        if state == "sliding":
            gradient[i] = by_kept[shape[1] * i : shape[1] * (i + 1), column]
        column += {"stuck": shape[1], "sliding": 1, "detached": 0}[state]
    return gradient
