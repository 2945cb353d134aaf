"""Which contact forces are allowed: the friction cone, and the size of a grasp's normal forces.

For contacts that are no hard fingers, intensities and covectors of
:class:`~grasp_planner.model.contact_model.ContactModel` stand for forces and normals, d numbers for three.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..spatial import Array


def normal_forces(forces: Array, normals: Array) -> Array:
    """Return f_n = n·f of each contact, positive when the finger pushes.

    Args:
        forces: Contact forces [N], of shape (…, n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).

    Returns:
        Normal forces [N], of shape (…, n_c).
    """
    return np.einsum("...ij,ij->...i", forces, normals)


def friction_margins(forces: Array, normals: Array, friction: npt.ArrayLike) -> Array:
    """Return μ f_n − |f_t| of each contact; not negative inside the cone. [Mavrogiannis2014] eq. (30).

    A hard finger transmits no torque; the condition implies f_n ≥ 0.

    Args:
        forces: Contact forces [N], of shape (…, n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: Coefficient of friction μ, one number or one for each contact.

    Returns:
        Margins [N], of shape (…, n_c).
    """
    normal = normal_forces(forces, normals)
    tangential = forces - normal[..., None] * normals
    return np.asarray(friction) * normal - np.linalg.norm(tangential, axis=-1)


def friction_angles(forces: Array, normals: Array) -> Array:
    """Return the angle between each contact force and its normal [rad]; the cone allows up to atan μ.

    Args:
        forces: Contact forces [N], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).

    Returns:
        Angles in [0, π], of shape (n_c,).
    """
    normal = normal_forces(forces, normals)
    return np.arctan2(np.linalg.norm(forces - normal[:, None] * normals, axis=1), normal)


def force_norm(forces: Array, normals: Array) -> float:
    """Return F = √(Σ f_n²), the size of the grasping force; [Mavrogiannis2014] eq. (18).

    Args:
        forces: Contact forces [N], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).

    Returns:
        F [N].
    """
    return float(np.linalg.norm(normal_forces(forces, normals)))
