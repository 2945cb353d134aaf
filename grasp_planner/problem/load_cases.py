"""What a planned grasp has to withstand besides its nominal load: disturbances, safety of friction, force limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ..checks import finite_array
from ..exceptions import InvalidValueError
from ..spatial import Array, readonly
from ..values import Value
from .settings import check_settings, setting, text_of_numbers


def sphere_directions(*, edges: bool = False) -> Array:
    """Return unit directions of a cube: ±x, ±y, ±z, the 8 diagonals and, if asked for, the 12 edges.

    The hull of the 14 contains the sphere of radius 0.805, that of the 26 the sphere of radius 0.862.

    Args:
        edges: Whether to add the directions of the edges' middles.

    Returns:
        Directions, of shape (14, 3) or (26, 3).
    """
    allowed = (1, 2, 3) if edges else (1, 3)
    points = [p for p in product((-1.0, 0.0, 1.0), repeat=3) if sum(map(abs, p)) in allowed]
    points.sort(key=lambda p: (sum(map(abs, p)), p))
    directions = np.array(points)
    return readonly(directions / np.linalg.norm(directions, axis=1, keepdims=True))


@dataclass(frozen=True, eq=False, repr=False)
class LoadCases(Value):
    """Disturbances Δw of the external wrench that the grasp has to withstand, one at a time, and its limits.

    The hand answers passively, f_k = f − G_K^R Δw_k, or f − K Gᵀ ν_k to a displaced object. In every case forces lie
    in the cones of μ/s, normal forces between their limits, joint torques within theirs. Friction is held at 14
    directions of each sphere (and, the cones being convex, on their hull, which contains the sphere of 0.8 of the
    radius); the linear limits hold on the whole spheres, exactly.

    Attributes:
        force: Radius of the sphere of disturbing forces at the object's centre [N].
        torque: Radius of the sphere of disturbing torques [N m].
        acceleration: Acceleration of the object in any direction [m/s²]: a sphere of forces of radius mass times
            acceleration; of the two spheres of forces the larger one counts.
        position_error: Radius of the sphere of shifts of the object, the palm and the references held, its support
            keeping it where it is [m].
        rotation_error: The same for turns about its centre [rad].
        wrenches: Further disturbances in O [N, N m], each of six numbers.
        friction_safety: s ≥ 1: the cones are those of μ/s, in the nominal case too.
        min_normal_force: Least normal force of every contact in every case [N].
        max_normal_force: Largest normal force of every contact [N]; the hand's own limit, if any, if None.
        max_force_norm: Largest F = √(Σ f_n²) of the nominal case [N]; none if None.
        hand_limits: Whether the hand's limits of normal forces and joint torques count.
    """

    settings_group: ClassVar[str] = "loads."

    force: float = setting(
        1.0,
        "Disturbing force to withstand, in any direction.",
        unit="N",
        low=0.0,
        high=1e4,
        step=0.1,
        option="--load-force",
    )
    torque: float = setting(
        0.0,
        "Disturbing torque to withstand, about any axis.",
        unit="N m",
        low=0.0,
        high=1e3,
        step=0.01,
        option="--load-torque",
    )
    acceleration: float = setting(
        0.0,
        "Acceleration of the object to withstand, in any direction.",
        unit="m/s²",
        low=0.0,
        high=1e4,
        step=0.1,
        option="--load-acceleration",
    )
    position_error: float = setting(
        0.0, "Shift of the object to withstand, in any direction.", unit="m", low=0.0, high=1.0, step=1e-3
    )
    rotation_error: float = setting(
        0.0, "Turn of the object to withstand, about any axis.", unit="rad", low=0.0, high=3.2, step=0.01
    )
    wrenches: tuple[tuple[float, ...], ...] = setting(
        (),
        "A further disturbance fx,fy,fz or fx,fy,fz,mx,my,mz in the object frame.",
        unit="N, N m",
        low=-1e4,
        high=1e4,
        option="--load-wrench",
        many=True,
        read=lambda text: wrench_of_text(text),
        write=text_of_numbers,
        plain=list[tuple[float, float, float, float, float, float]],
    )
    friction_safety: float = setting(1.2, "s: forces stay in the cones of μ/s.", low=1.0, high=100.0, step=0.05)
    min_normal_force: float = setting(
        0.1, "Least normal force of every contact.", unit="N", low=0.0, high=1e4, step=0.1
    )
    max_normal_force: float | None = setting(
        None,
        "Largest normal force of every contact.",
        kind="number",
        unit="N",
        low=0.0,
        high=1e5,
        above=True,
        none="the hand's",
    )
    max_force_norm: float | None = setting(
        None,
        "Largest grasping force F of the nominal case.",
        kind="number",
        unit="N",
        low=0.0,
        high=1e5,
        above=True,
        none="no limit",
    )
    hand_limits: bool = setting(True, "Whether the hand's limits of normal forces and joint torques count.")

    def __post_init__(self) -> None:
        given = self.wrenches if isinstance(self.wrenches, list | tuple | np.ndarray) else (self.wrenches,)
        wrenches = tuple(tuple(finite_array("loads.wrenches", w, (6,)).tolist()) for w in given)
        object.__setattr__(self, "wrenches", wrenches)
        check_settings(self)
        if self.max_normal_force is not None and self.max_normal_force <= self.min_normal_force:
            allowed = f"more than the least, {self.min_normal_force:g} N"
            raise InvalidValueError("loads.max_normal_force", self.max_normal_force, allowed)

    @classmethod
    def off(cls) -> LoadCases:
        """Return no load case at all: the paper's problem, with its nominal load only."""
        return cls(force=0.0, friction_safety=1.0, min_normal_force=0.0, hand_limits=False)

    @cached_property
    def active(self) -> bool:
        """Whether anything is asked for beyond the paper's problem."""
        return self != LoadCases.off()

    @property
    def disturbed(self) -> bool:
        """Whether there is any disturbance, so that the answer of the hand matters."""
        return bool(self.force or self.torque or self.acceleration or self.wrenches or self.displaced)

    @property
    def displaced(self) -> bool:
        """Whether the object may be displaced: disturbances then have a twist ν behind the wrench Δw."""
        return bool(self.position_error or self.rotation_error)

    @property
    def size(self) -> int:
        """Length of a disturbance: 6, or 12 where the object may be displaced."""
        return 12 if self.displaced else 6

    def spheres(self, mass: float) -> tuple[tuple[slice, float], ...]:
        """Return the spheres of disturbances: which part of (Δw, ν), and the radius [N, N m, m, rad]."""
        force = max(self.force, self.acceleration * mass)
        radii = (force, self.torque, self.position_error, self.rotation_error)
        parts = tuple((slice(3 * k, 3 * k + 3), radius) for k, radius in enumerate(radii))
        return tuple((part, radius) for part, radius in parts if radius > 0.0)

    def listed(self) -> Array:
        """Return the nominal case, zero, and the listed disturbances in O [N, N m], of shape (1 + n, 6 or 12)."""
        rows = np.zeros((1 + len(self.wrenches), self.size))
        rows[1:, :6] = np.reshape(self.wrenches, (-1, 6))
        return rows

    def cases(self, mass: float) -> Array:
        """Return all load cases: none, the listed ones, 14 of each sphere.

        Args:
            mass: Mass of the object [kg].

        Returns:
            Δw in O [N, N m] and, where the object may be displaced, ν [m, rad], of shape (n_k, 6 or 12).
        """
        blocks = [self.listed()]
        for part, radius in self.spheres(mass):
            block = np.zeros((14, self.size))
            block[:, part] = radius * sphere_directions()
            blocks.append(block)
        return readonly(np.vstack(blocks))


def wrench_of_text(text: str) -> tuple[float, ...]:
    """Return the six numbers of a text fx,fy,fz,mx,my,mz or, without torque, fx,fy,fz [N, N m].

    Raises:
        InvalidValueError: If it is anything else.
    """
    try:
        values: npt.ArrayLike = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    numbers = np.asarray(values, dtype=float)
    if numbers.size not in (3, 6) or not np.isfinite(numbers).all():
        raise InvalidValueError("loads.wrenches", text, "fx,fy,fz or fx,fy,fz,mx,my,mz in N and N m")
    return tuple(np.concatenate([numbers, np.zeros(6 - numbers.size)]).tolist())
