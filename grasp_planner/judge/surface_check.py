"""Contacts on the exact surface of the object: of a mesh its triangles, never the smooth distance of the search."""

from __future__ import annotations

import numpy as np

from ..model.contacts import Contacts
from ..objects import GraspObject
from ..spatial import Array

OFF_SURFACE = 2e-4
"""How far a fingertip may be off the triangles: what a pad of rubber takes up [m]."""
FOOTPRINT = 1e-3
"""How far around a contact the surface counts [m] …"""
SPREAD = float(np.radians(40.0))
"""… and the widest angle between its normals there that a finger can rest on [rad]."""


def exact_contacts(contacts: Contacts, radii: Array, grasp_object: GraspObject) -> Contacts:
    """Return the contacts of the same fingertips with the exact surface.

    Args:
        contacts: Contacts by the object's smooth distance.
        radii: Fingertip radii [m], of shape (n_c,).
        grasp_object: The object.

    Returns:
        Nearest points of the exact surface, its normals into the object and the gaps; the same contacts if the
        smooth distance is the exact one, or if they are no numbers.
    """
    if grasp_object.distance_error == 0.0 or not np.isfinite(contacts.points).all():
        return contacts
    near = grasp_object.nearest(contacts.points - radii[:, None] * contacts.normals)
    return Contacts(near.points, -near.normals, near.distance - radii)
