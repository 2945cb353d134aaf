"""Contacts of several models in one grasp, in the form that one model has: every contact with as many intensities.

Intensities that a contact's own model lacks are there and do nothing: their columns of G and rows of J are zero. So
cones, wrench spaces and force optimisation are exact; what counts dimensions takes the columns that are used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..exceptions import InvalidValueError
from ..spatial import Array
from .contact_model import ContactModel, SoftFinger
from .quasi_static import CompliantGrasp


@dataclass(frozen=True, eq=False, repr=False)
class MixedContacts(ContactModel):
    """A model for each contact, padded to the intensities of a soft finger.

    Attributes:
        models: The contacts' own models, in their order.
    """

    kind, dimension, fewest_contacts = "mixed", SoftFinger.dimension, 2

    models: tuple[ContactModel, ...] = ()

    @property
    def used(self) -> npt.NDArray[np.bool_]:
        """Which of the d n_c intensities belong to a contact's own model, of shape (d n_c,)."""
        return np.concatenate([np.arange(self.dimension) < model.dimension for model in self.models])

    @property
    def frictional(self) -> npt.NDArray[np.bool_]:
        """Which contacts have friction, of shape (n_c,)."""
        return np.array([model.has_friction for model in self.models])

    @property
    def text(self) -> str:
        """The models' text forms."""
        return ", ".join(model.text for model in self.models)

    def basis(self, normals: Array) -> Array:
        """Return the contacts' own H, columns of zeros behind them, of shape (n_c, 6, 4)."""
        if len(normals) != len(self.models):
            raise InvalidValueError("contact_model", len(self.models), f"one for each of the {len(normals)} contacts")
        held = np.zeros((len(normals), 6, self.dimension))
        for i, model in enumerate(self.models):
            held[i, :, : model.dimension] = model.basis(normals[i : i + 1])[0]
        return held

    def basis_slope(self, normals: Array) -> Array:
        """Return ∂H/∂n, of shape (n_c, 6, 4, 3)."""
        slope = np.zeros((len(normals), 6, self.dimension, 3))
        for i, model in enumerate(self.models):
            slope[i, :, : model.dimension] = model.basis_slope(normals[i : i + 1])[0]
        return slope

    def padded(self, springs: CompliantGrasp) -> CompliantGrasp:
        """Return a grasp whose G and J have the contacts' own rows and columns with those that do nothing put in."""
        used, free = np.flatnonzero(self.used), np.flatnonzero(~self.used)
        grasp = np.zeros((6, len(self.used)))
        jacobian = np.zeros((len(self.used), springs.jacobian.shape[1]))
        compliance = np.zeros((len(self.used), len(self.used)))
        grasp[:, used], jacobian[used] = springs.grasp, springs.jacobian
        compliance[np.ix_(used, used)] = springs.contact_compliance
        # Any spring will do where nothing moves it; one as soft as the others keeps the system well conditioned.
        compliance[free, free] = float(np.diag(springs.stiffness).max()) ** -1
        return CompliantGrasp(
            grasp,
            jacobian,
            springs.basis,
            compliance,
            springs.joint_compliance,
            springs.synergy_compliance,
            springs.preload,
        )
