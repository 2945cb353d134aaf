"""A closed hand lifts the object from its table and shakes it.

Seen from the palm, which does not turn: the table goes down as the palm goes up, and every mass, of the object and of
the links, feels −m a of the palm's acceleration a. Contacts then know how fast hand and object move against each other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..spatial import Array
from .protocol import Protocol
from .result import DirectionReport
from .world import Snapshot, World

TICK_S = 0.01
"""How often the palm's acceleration is set anew [s]."""


def lift(world: World, run: Callable[[float], None]) -> None:
    """Lift the palm smoothly by the protocol's way: 10 s³ − 15 s⁴ + 6 s⁵ of it at a share s of the time.

    Args:
        world: The simulation, the hand closed.
        run: What lets time pass [s].
    """
    protocol, up = world.protocol, world.grasp.problem.up
    for tick in range(round(protocol.lift_s / TICK_S)):
        way, acceleration = _lifted(protocol, (tick + 0.5) * TICK_S)
        world.lower_table(way)
        world.accelerate(acceleration * up)
        run(TICK_S)
    world.lower_table(protocol.lift)
    world.accelerate(np.zeros(3))


def shake_all(world: World, begin: Snapshot) -> tuple[DirectionReport, ...]:
    """Shake the palm along x, y and z of O, each from the same instant; looked at all the time."""
    return tuple(_shaken(world, begin, name, way) for name, way in zip("xyz", np.eye(3), strict=True))


def _lifted(protocol: Protocol, time: float) -> tuple[float, float]:
    """Return how far up the palm is at a time [m], and its acceleration [m/s²]."""
    s = time / protocol.lift_s
    way = protocol.lift * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    return way, protocol.lift / protocol.lift_s**2 * (60.0 * s - 180.0 * s**2 + 120.0 * s**3)


def _shaken(world: World, begin: Snapshot, name: str, way: Array) -> DirectionReport:
    """Shake along one axis: a sine that grows over its first period."""
    world.restore(begin)
    protocol = world.protocol

    def ticks() -> Iterator[float]:
        for tick in range(round(protocol.shake_s / TICK_S)):
            turns = (tick + 0.5) * TICK_S * protocol.shake_hz
            world.accelerate(min(1.0, turns) * protocol.shake * np.sin(2.0 * np.pi * turns) * way)
            yield TICK_S

    held, far, turned = world.watch(ticks())
    world.accelerate(np.zeros(3))
    return DirectionReport("shake", name, protocol.shake, held, far, turned)
