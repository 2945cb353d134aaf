"""Parameters of the model."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..checks import finite_array, positive
from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Array, readonly
from ..values import Value

STANDARD_GRAVITY = 9.81
"""Gravity [m/s²]."""


TorqueModel = Literal["total", "internal"]


@dataclass(frozen=True, eq=False, repr=False)
class GraspParameters(Value):
    """Parameters of the model; the defaults are those of [Mavrogiannis2014] section IV (choice A3).

    Attributes:
        friction: Coefficient of friction μ.
        structural_compliance: C_s [m/N].
        joint_compliance: C_q [rad/(N m)], one number or one for each joint in the order of q; the hand's own
            (0.1 for the DLR/HIT II, as in the paper) if None.
        contact_stiffness: K_c [N/m].
        force_weight: w_F in z = w_F F + w_C C; eq. (29).
        task_weight: w_C.
        gravity: Acceleration of gravity in O [m/s²], of shape (3,) (choice A4: along −z).
        torque_model: Which torque bends the joints in eq. (10): that of the ``total`` contact force, or of the
            ``internal`` forces only as in eq. (33) (choice A5).
    """

    friction: float = 0.8
    structural_compliance: float = 0.1
    joint_compliance: float | tuple[float, ...] | None = None
    contact_stiffness: float = 1e5
    force_weight: float = 1e-6
    task_weight: float = 1.0
    gravity: Array = field(default_factory=lambda: readonly([0.0, 0.0, -STANDARD_GRAVITY]))
    torque_model: TorqueModel = "total"

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("friction", self.friction)
        positive("structural_compliance", self.structural_compliance, unit="m/N")
        for value in np.atleast_1d(0.0 if self.joint_compliance is None else self.joint_compliance):
            positive("joint_compliance", value, zero_allowed=True, unit="rad/(N m)")
        positive("contact_stiffness", self.contact_stiffness, zero_allowed=True, unit="N/m")
        positive("force_weight", self.force_weight, zero_allowed=True)
        positive("task_weight", self.task_weight, zero_allowed=True)
        if self.force_weight == 0.0 and self.task_weight == 0.0:
            raise InvalidValueError("force_weight, task_weight", (0.0, 0.0), "at least one of them > 0")
        object.__setattr__(self, "gravity", finite_array("gravity", self.gravity, (3,)))
        if self.torque_model not in ("total", "internal"):
            raise NameNotFoundError("torque model", str(self.torque_model), ("total", "internal"))
