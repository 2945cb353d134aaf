"""How all joints of a URDF follow the independent ones, and the limits that leaves for these."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Array
from .urdf_file import MimicJoint


def joint_coupling(model: Any, joints: tuple[str, ...], mimics: dict[str, MimicJoint]) -> tuple[Array, Array]:
    """Return the map from independent joints to all joints of the model."""
    known = tuple(model.names)[1:]
    for name in joints:
        if name not in known:
            raise NameNotFoundError("joint", name, known)
        if name in mimics:
            raise InvalidValueError("joints", name, "joints without <mimic>; the others follow them")
    coupling = np.zeros((model.nv, len(joints)))
    offset = np.zeros(model.nv)
    for index, name in enumerate(known):
        source, multiplier, shift = name, 1.0, 0.0
        if name in mimics:
            source, multiplier, shift = mimics[name].source, mimics[name].multiplier, mimics[name].offset
        if source not in joints:
            raise InvalidValueError(
                "joints", name, f"every moving joint listed or mimicking a listed one ({', '.join(joints)})"
            )
        coupling[index, joints.index(source)] = multiplier
        offset[index] = shift
    return coupling, offset


def joint_limits(model: Any, joints: tuple[str, ...], coupling: Array, offset: Array) -> tuple[Array, Array]:
    """Return limits of the independent joints that keep every coupled joint within its own."""
    lower = np.full(len(joints), -np.inf)
    upper = np.full(len(joints), np.inf)
    for full, column in zip(*np.nonzero(coupling), strict=True):
        ends = (np.array([model.lowerPositionLimit[full], model.upperPositionLimit[full]]) - offset[full]) / (
            coupling[full, column]
        )
        lower[column] = max(lower[column], ends.min())
        upper[column] = min(upper[column], ends.max())
    for name, low, high in zip(joints, lower, upper, strict=True):
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise InvalidValueError(f"limits of joint {name}", (float(low), float(high)), "finite, lower < upper")
    return lower, upper
