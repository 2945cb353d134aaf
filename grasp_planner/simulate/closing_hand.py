"""How a simulated hand closes: it approaches, grips, and squeezes on until its motors feel what they should.

The references follow :class:`~grasp_planner.closing.path.ReferencePath`: slowly from open to touching, quickly on to
the plan's, so that a loose object has no time to leave between the first finger and the last. Then a guarded squeeze:
they go on along the way that raises the planned forces until the efforts that the motors measure are as large as
asked for, and stay there. Efforts are Sᵀ τ, of the torques τ of the joint springs: what motor currents show.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..closing.path import ReferencePath, free_posture
from ..spatial import Array
from .mjcf_hand import spring_stiffness
from .motors import holding_range
from .world import World

SET_S = 0.004
"""Time between set-points [s]."""
FIRM_RATE, FIRM_S = 10.0, 1.0
"""Squeezing on: how many times the plan's forces are added each second, and for how long [s]."""


class MotorEfforts:
    """Efforts of the motors of a hand against those that a closing was planned with.

    Args:
        world: The simulation; its grasp may be off the plan, its joint angles are the plan's.
        path: The planned references.
    """

    def __init__(self, world: World, path: ReferencePath) -> None:
        problem = world.grasp.problem
        self._world, self._synergies = world, problem.synergies
        self._stiffness, basis = spring_stiffness(problem), problem.synergies.basis
        self._by_effort = np.linalg.inv(basis.T @ self._stiffness @ basis)
        self._limits = problem.torque_limits
        self.planned = basis.T @ self._torques(path.squeezing, world.grasp.joint_angles)

    def _torques(self, sigma: Array, q: Array) -> Array:
        """Return the torques of the joint springs [N m], of shape (n_q,)."""
        return np.asarray(self._stiffness @ (self._synergies.joint_angles(sigma) - q))

    @property
    def torques(self) -> Array:
        """Torques of the joint springs as they are [N m], of shape (n_q,)."""
        return self._torques(self._world.references, self._world.independent_angles)

    @property
    def efforts(self) -> Array:
        """Sᵀ τ as it is [N m], of shape (n_s,)."""
        return np.asarray(self._synergies.basis.T @ self.torques)

    @property
    def ratio(self) -> float:
        """Size of the efforts over that of the planned ones, both by the spring energy that the motors put in."""
        return float(self._size(self.efforts) / max(self._size(self.planned), 1e-12))

    @property
    def torque_use(self) -> float:
        """Largest share of a joint's torque limit."""
        return float((np.abs(self.torques) / self._limits).max())

    def _size(self, efforts: Array) -> float:
        return float(np.sqrt(efforts @ self._by_effort @ efforts))


def close_hand(world: World, path: ReferencePath, run: Callable[[float], None]) -> None:
    """Close a hand from open around the object, then let go of the object and let it weigh.

    Args:
        world: The simulation.
        path: The references.
        run: What lets time pass [s].
    """
    protocol = world.protocol
    world.reset(free_posture(world.grasp, path.open), path.open)
    world.hold_object(protocol.hold_while_closing)
    world.carry_object(protocol.carried)
    world.weigh(protocol.hold_while_closing or protocol.table)
    world.make_way()
    for (begin, end), duration in zip(path.stages(), (protocol.stage_s, protocol.grip_s), strict=True):
        steps = max(1, round(duration / SET_S))
        for step in range(1, steps + 1):
            world.set_references(begin + step / steps * (end - begin))
            run(duration / steps)
    if protocol.firmness > 1.0 and path.onward is not None:
        _squeeze_on(world, path, run)
    world.carry_object(None)


def _squeeze_on(world: World, path: ReferencePath, run: Callable[[float], None]) -> None:
    """Move the references on until the efforts are large enough, a joint is at its torque limit or the way ends.

    How far contacts stay within their cones counts from where the efforts are as planned: with the palm off, fingers
    first have to arrive.
    """
    assert path.onward is not None
    motors, bounds = MotorEfforts(world, path), holding_range(world.grasp.problem)
    share, end = 0.0, path.onward.reach
    for _ in range(round(FIRM_S / SET_S)):
        ratio = motors.ratio
        if ratio < 1.0:
            end = share + path.onward.reach
        if share < end and ratio < world.protocol.firmness and motors.torque_use < 1.0:
            share = min(end, share + FIRM_RATE * SET_S)
            goal = path.squeezing + share * path.onward.way
            world.set_references(goal if bounds is None else np.clip(goal, *bounds))
        run(SET_S)
