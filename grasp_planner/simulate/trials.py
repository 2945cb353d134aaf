"""Pushes on the object from a given instant: the six directions, and the ladder up to the load that is lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..spatial import Array
from .protocol import Protocol
from .result import DirectionReport
from .world import Snapshot, World

RAMP_S, HOLD_S, LOOK_S = 0.2, 0.8, 0.1
"""A rung of the ladder: its load grows, then stays; how often the object is looked at [s]."""
FIRST_RUNG = 0.25
"""First load of the ladder, as a share of the load of the test."""
DIRECTIONS = tuple(
    (kind, f"{'+-'[sign < 0]}{axis}", index, float(sign))
    for kind in ("force", "torque")
    for index, axis in enumerate("xyz")
    for sign in (1, -1)
)
"""Kind, name, axis and sign of all pushes."""


def torque_arm(protocol: Protocol, length_scale: float) -> float:
    """Return the arm of the torques tested [m]."""
    return length_scale if protocol.torque_arm is None else protocol.torque_arm


def push_all(world: World, begin: Snapshot, *, ladder: bool) -> tuple[DirectionReport, ...]:
    """Push in every direction of the protocol, each from the same instant.

    Args:
        world: The simulation.
        begin: The instant.
        ladder: Whether to look for the load that is lost, too.

    Returns:
        One report a direction.
    """
    protocol = world.protocol
    arm = torque_arm(protocol, world.grasp.problem.grasp_object.length_scale)
    reports = []
    for kind, name, axis, sign in DIRECTIONS:
        if kind == "torque" and not protocol.torques:
            continue
        unit = np.zeros(6)
        unit[axis + (3 if kind == "torque" else 0)] = sign
        scale = arm if kind == "torque" else 1.0
        report = _push(world, begin, kind, name, unit, protocol.force * scale)
        if ladder:
            held, lost = _climb(world, begin, unit, scale)
            report = replace(report, load_held=held, load_lost=lost)
        reports.append(report)
    return tuple(reports)


def _push(world: World, begin: Snapshot, kind: str, name: str, unit: Array, load: float) -> DirectionReport:
    """Push with one load for the protocol's time."""
    world.restore(begin)
    world.push(load * unit)
    held, far, turned = world.watch(np.diff(world.protocol.check_times, prepend=0.0).tolist())
    world.push(np.zeros(6))
    return DirectionReport(kind, name, load, held, far, turned)


def _climb(world: World, begin: Snapshot, unit: Array, scale: float) -> tuple[float, float | None]:
    """Double the load until it is lost, then halve the bracket; return the bracket."""
    protocol = world.protocol
    held, load, cap = 0.0, FIRST_RUNG * protocol.force * scale, protocol.ladder_cap * scale
    while _rung_holds(world, begin, load * unit):
        held, load = load, 2.0 * load
        if held >= cap:
            return held, None
    lost = load
    while lost - held > protocol.ladder_accuracy * lost and lost > 1e-3 * protocol.force * scale:
        middle = (held + lost) / 2.0
        held, lost = (middle, lost) if _rung_holds(world, begin, middle * unit) else (held, middle)
    return held, lost


def _rung_holds(world: World, begin: Snapshot, wrench: Array) -> bool:
    """Return whether the object stays within the limits while a load grows and stays."""
    world.restore(begin)
    for share in np.arange(LOOK_S / 2, RAMP_S, LOOK_S / 2) / RAMP_S:
        world.push(share * wrench)
        world.run(LOOK_S / 2)
    world.push(wrench)
    holds = world.within_limits
    for _ in range(round(HOLD_S / LOOK_S)):
        if not holds:
            break
        world.run(LOOK_S)
        holds = world.within_limits
    world.push(np.zeros(6))
    return holds
