"""What a contact transmits: hard fingers, soft fingers, frictionless contacts, as values.

A contact transmits d intensities λ. Its holding basis H(n), of shape (6, d), turns them into force and moment at the
contact point, so that with X_i = [I, 0; skew(c_i), I] the grasp matrix has the blocks G_i = X_i H_i and the hand
Jacobian the blocks J_i = H_iᵀ (v_i; ω_i) of the touching point of the link; [Murray1994] section 5.2.

All intensities are forces [N], scaled so that the cone is round in them: with the covector ν = H_fᵀ n, H_f the three
force rows, f_n = ν·λ, and λ is allowed where |λ − f_n ν| ≤ μ f_n. So one formula a cone serves every model.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ..checks import positive
from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Array, readonly, skew
from ..values import Value, exact_text

PATCH_OF_TORSION = 16.0 / (3.0 * math.pi)
"""Radius of a patch with Hertz's pressure over its torsion length: ∫ μ p r dA = (3π/16) a μ f_n; [Johnson1985]."""


@dataclass(frozen=True, eq=False, repr=False)
class ContactModel(Value, ABC):
    """What every contact of a grasp transmits; to add one, give kind, numbers, basis and its slope.

    Attributes:
        kind: Name in the text form.
        dimension: d, the number of intensities of a contact.
        fewest_contacts: Fewest contacts that can be force-closed.
        has_friction: Whether the coefficient of friction counts.
    """

    kind: ClassVar[str]
    dimension: ClassVar[int]
    fewest_contacts: ClassVar[int]
    has_friction: ClassVar[bool] = True

    @abstractmethod
    def basis(self, normals: Array) -> Array:
        """Return the holding basis H of every contact: three rows of force, three of moment about the contact point.

        Args:
            normals: Unit normals into the object, of shape (n_c, 3).

        Returns:
            H [1; m], of shape (n_c, 6, d).
        """

    @abstractmethod
    def basis_slope(self, normals: Array) -> Array:
        """Return ∂H/∂n, of shape (n_c, 6, d, 3)."""

    @property
    def stiffness_factors(self) -> Array:
        """Stiffness of a contact against the motion each intensity does work on, in units of K_c, of shape (d,)."""
        return np.ones(self.dimension)

    @property
    def text(self) -> str:
        """Text form, such as ``soft:torsion=0.005``."""
        own = [f"{each.name}={exact_text(getattr(self, each.name))}" for each in fields(self)]
        return f"{self.kind}:{','.join(own)}" if own else self.kind

    def covectors(self, normals: Array) -> Array:
        """Return ν = H_fᵀ n of every contact, of shape (n_c, d): f_n = ν·λ."""
        return np.einsum("cid,ci->cd", self.basis(normals)[:, :3], normals)

    def tangential(self, normals: Array) -> Array:
        """Return I − ν νᵀ of every contact, the map to what friction has to hold, of shape (n_c, d, d)."""
        covectors = self.covectors(normals)
        return np.eye(self.dimension) - covectors[:, :, None] * covectors[:, None, :]

    def cone_rows(self, normals: Array, friction: npt.ArrayLike, size: int) -> list[Array]:
        """Return for each contact the rows A with A x = (μ f_n, λ − f_n ν), which has to lie in the second-order cone.

        Args:
            normals: Unit normals into the object, of shape (n_c, 3).
            friction: Coefficient of friction μ, one number or one for each contact.
            size: Number of variables x; the first d n_c are the intensities.

        Returns:
            One array of shape (1 + d, size) for each contact.
        """
        d, coefficients = self.dimension, np.broadcast_to(friction, len(normals))
        rows = np.zeros((len(normals), 1 + d, size))
        for i, (covector, across) in enumerate(zip(self.covectors(normals), self.tangential(normals), strict=True)):
            rows[i, 0, d * i : d * i + d] = coefficients[i] * covector
            rows[i, 1:, d * i : d * i + d] = across
        return list(rows)

    def covector_slope(self, normals: Array) -> Array:
        """Return ∂ν/∂n, of shape (n_c, d, 3)."""
        basis, slope = self.basis(normals)[:, :3], self.basis_slope(normals)[:, :3]
        return np.einsum("cidk,ci->cdk", slope, normals) + basis.transpose(0, 2, 1)

    def grasp_matrix(self, points: Array, normals: Array) -> Array:
        """Return the grasp matrix G: intensities to the wrench on the object, ``g = G λ``.

        Args:
            points: Contact points in O [m], of shape (n_c, 3).
            normals: Unit normals into the object, of shape (n_c, 3).

        Returns:
            G, of shape (6, d n_c), force rows first.
        """
        held = np.array(self.basis(normals))
        held[:, 3:] += skew(points) @ held[:, :3]
        return held.transpose(1, 0, 2).reshape(6, -1)

    def hand_jacobian(self, twists: Array, normals: Array) -> Array:
        """Return the hand Jacobian J: joint velocities to the motions that the intensities do work on, ``τ = Jᵀ λ``.

        Args:
            twists: Velocity of the touching points and angular velocity of their links in O by the independent joint
                velocities, of shape (n_c, 6, n_q).
            normals: Unit normals into the object, of shape (n_c, 3).

        Returns:
            J [m/rad], of shape (d n_c, n_q).
        """
        return (self.basis(normals).transpose(0, 2, 1) @ twists).reshape(-1, twists.shape[2])

    def forces(self, intensities: Array, normals: Array) -> Array:
        """Return the contact forces of intensities [N], of shape (n_c, 3)."""
        return np.einsum("cid,cd->ci", self.basis(normals)[:, :3], intensities)

    def moments(self, intensities: Array, normals: Array) -> Array:
        """Return the contact moments of intensities about the contact points [N m], of shape (n_c, 3)."""
        return np.einsum("cid,cd->ci", self.basis(normals)[:, 3:], intensities)


@dataclass(frozen=True, eq=False, repr=False)
class HardFinger(ContactModel):
    """A point with friction: any force in its cone, no moment. λ is the force in O; [Mavrogiannis2014]."""

    kind, dimension, fewest_contacts = "hard", 3, 3

    def basis(self, normals: Array) -> Array:
        """Return H = [I; 0], of shape (n_c, 6, 3)."""
        return np.tile(np.eye(6, 3), (len(normals), 1, 1))

    def basis_slope(self, normals: Array) -> Array:
        """Return zeros, of shape (n_c, 6, 3, 3)."""
        return np.zeros((len(normals), 6, 3, 3))

    def covectors(self, normals: Array) -> Array:
        """Return the normals themselves, of shape (n_c, 3)."""
        return normals

    def tangential(self, normals: Array) -> Array:
        """Return −skew(n)², of shape (n_c, 3, 3)."""
        cross = skew(normals)
        return -cross @ cross


@dataclass(frozen=True, eq=False, repr=False)
class SoftFinger(ContactModel):
    """A point with friction that also resists turning about its normal. λ is the force in O and m/γ.

    The cone is √(|f_t|² + (m/γ)²) ≤ μ f_n, the elliptic limit surface of [Howe1996]. The contact's torsional stiffness
    is a² K_c with a = 16 γ/(3π): under full sliding a patch of radius a with Hertz's pressure transmits the torque of
    friction at γ, and an incompressible half-space resists turning of a bonded disc a² times as stiffly as its
    shift along the surface, 16 G a³/3 against 8 G a/(2 − ν) with ν = 1/2; [Johnson1985] sections 3.9 and 4.2.

    Attributes:
        torsion: Torsion length γ [m]; the default belongs to a patch of about 5 mm radius.
    """

    kind, dimension, fewest_contacts = "soft", 4, 2

    torsion: float = 0.003

    def __post_init__(self) -> None:
        object.__setattr__(self, "torsion", positive("contact_model soft.torsion", self.torsion, unit="m"))

    @property
    def patch_radius(self) -> float:
        """Radius a of the patch that transmits so much torque [m]."""
        return PATCH_OF_TORSION * self.torsion

    @property
    def stiffness_factors(self) -> Array:
        """Stiffness factors, of shape (4,); the last is a²/γ²."""
        return readonly([1.0, 1.0, 1.0, PATCH_OF_TORSION**2])

    def basis(self, normals: Array) -> Array:
        """Return H = [I, 0; 0, γ n], of shape (n_c, 6, 4)."""
        held = np.tile(np.eye(6, 4), (len(normals), 1, 1))
        held[:, 3, 3] = 0.0
        held[:, 3:, 3] = self.torsion * normals
        return held

    def basis_slope(self, normals: Array) -> Array:
        """Return ∂H/∂n, of shape (n_c, 6, 4, 3): γ for the moment."""
        slope = np.zeros((len(normals), 6, 4, 3))
        slope[:, 3:, 3] = self.torsion * np.eye(3)
        return slope


@dataclass(frozen=True, eq=False, repr=False)
class Frictionless(ContactModel):
    """A contact that only presses. λ is the normal force; seven contacts at least [Lakshminarayana1978]."""

    kind, dimension, fewest_contacts, has_friction = "frictionless", 1, 7, False

    def basis(self, normals: Array) -> Array:
        """Return H = [n; 0], of shape (n_c, 6, 1)."""
        return np.hstack([normals, np.zeros_like(normals)])[:, :, None]

    def basis_slope(self, normals: Array) -> Array:
        """Return ∂H/∂n, of shape (n_c, 6, 1, 3)."""
        return np.tile(np.eye(6, 3)[:, None], (len(normals), 1, 1, 1))


CONTACT_MODELS: dict[str, type[ContactModel]] = {model.kind: model for model in (HardFinger, SoftFinger, Frictionless)}
"""Contact models by the name used in the text form."""


def parse_contact_model(text: str) -> ContactModel:
    """Return the contact model of a text such as ``hard`` or ``soft:torsion=0.005``.

    Args:
        text: Name of a model, optionally followed by a colon and comma-separated ``key=value`` pairs in SI units.

    Returns:
        The model; keys left out have their defaults.

    Raises:
        NameNotFoundError: If the model or a key does not exist.
        InvalidValueError: If a value is malformed or out of range, or a key is given twice.
    """
    kind, _, rest = text.strip().partition(":")
    if kind not in CONTACT_MODELS:
        raise NameNotFoundError("contact_model", kind[:80], CONTACT_MODELS)
    model, values = CONTACT_MODELS[kind], {}
    known = [each.name for each in fields(model)]
    for part in filter(None, rest.split(",")):
        key, _, value = (piece.strip() for piece in part.partition("="))
        field = f"contact_model {kind}.{key}"
        if key not in known:
            raise NameNotFoundError(f"key of contact_model {kind}", key[:80], known)
        if key in values:
            raise InvalidValueError(field, part, "a key given once")
        try:
            values[key] = float(value)
        except ValueError:
            raise InvalidValueError(field, value[:80], "a number in SI units") from None
    return model(**values)
