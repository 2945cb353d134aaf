"""Motors that hold the lengths of their tendons once the hand has closed, as those of a position-controlled hand do.

The tension of the plan stays and a constraint on the length adds to it what the hand is pushed with, up or down: to
zero at least, where the tendon goes slack, and at most to the motor's limit, where it gives way.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..problem.problem import GraspProblem
from ..problem.tendon_drive import driving_tendons
from ..spatial import Array
from .engine import load_mujoco
from .xml_text import Element, add

STIFF = {"solref": [0.002, 1.0], "solimp": [0.999, 0.999, 0.001]}
"""How stiff joints and tendons follow what they are tied to."""


def holding_range(problem: GraspProblem) -> tuple[Array, Array] | None:
    """Return the least and the largest σ of motors that hold lengths [rad], each of shape (n_s,); None without such."""
    tendons = driving_tendons(problem)
    if tendons is None or not tendons.held:
        return None
    scales = tendons.scales(problem.joint_compliance)
    return scales * tendons.least, scales * tendons.largest


def add_holds(equality: Element, problem: GraspProblem) -> None:
    """Add what can hold the tendon of each synergy at a length, at first inactive."""
    if holding_range(problem) is not None:
        for k in range(problem.n_synergies):
            add(equality, "tendon", name=f"length_{k + 1}", tendon1=f"synergy_{k + 1}", active="false", **STIFF)


class HeldMotors:
    """The motors of a running simulation that hold lengths.

    Args:
        problem: The problem.
        model: MuJoCo's model, with what :func:`add_holds` adds.
    """

    def __init__(self, problem: GraspProblem, model: Any) -> None:
        self._model, self._range = model, holding_range(problem)
        mujoco = load_mujoco()
        count = 0 if self._range is None else problem.n_synergies
        self._equalities = [
            mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_EQUALITY, f"length_{k + 1}") for k in range(count)
        ]
        self._tendons = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, f"synergy_{k + 1}") for k in range(count)]

    def hold(self, data: Any) -> None:
        """Hold the tendons at the lengths they have."""
        for equality, tendon in zip(self._equalities, self._tendons, strict=True):
            self._model.eq_data[equality, 0] = data.ten_length[tendon] - self._model.tendon_length0[tendon]
            data.eq_active[equality] = True

    def give_way(self, data: Any) -> None:
        """Let go of the lengths whose motors would push, or pull beyond their limits: their tension stays there."""
        if self._range is None:
            return
        least, largest = self._range
        mine = np.asarray(data.efc_id)
        kinds = np.asarray(data.efc_type) == load_mujoco().mjtConstraint.mjCNSTR_EQUALITY
        for k, equality in enumerate(self._equalities):
            added = np.asarray(data.efc_force)[kinds & (mine == equality)]
            if added.size == 0:
                continue
            total = float(data.ctrl[k] + added[0])
            bound = float(np.clip(total, least[k], largest[k]))
            if bound != total:
                data.ctrl[k], data.eq_active[equality] = bound, False
