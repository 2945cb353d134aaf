"""Closing tolerance: how far palm, size, friction and mass may be off, and the hand that closes as planned still holds.

One thing is off at a time. The hand goes through the references of the plan, by the quasi-static closing of
:mod:`grasp_planner.closing`, and then has to hold pushes as strong as its load cases, 1 N without them; of a plan that
closing asks for half as much more, which is what errors use up. Simulation can judge instead
(:func:`grasp_planner.simulate.simulated_loss`); the two differ, and neither is always the stricter.
The palm is off along random directions, in which the worst one counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..checks import positive_whole
from ..closing.closing import close_grasp
from ..closing.path import ReferencePath
from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..spatial import Array
from .off_plan import grown, palm_moved, resized

FIRST, LEAST, ACCURACY = 1 / 32, 1 / 512, 0.1
"""First error tried, as a share of the largest, from which on it doubles, and the least; how far apart held and lost
may end, relative to lost."""
MOST_SHIFT, MOST_TURN_DEG, MOST_SIZE = 0.02, 20.0, 0.01
"""Largest errors that are tried: of the palm [m], [degrees], and of the object's surface [m] …"""
MOST_FACTOR = 8.0
"""… and the factor by which friction and mass grow or shrink at most."""

Off = Callable[[Grasp, float, Array], Grasp]
"""A grasp, an error and a random unit vector to the grasp with the error."""
Loss = Callable[[Grasp, ReferencePath], str | None]
"""A grasp and the references it closes by to why it is lost, None if it is not."""


@dataclass(frozen=True)
class ClosingTolerance:
    """How far one thing may be off.

    Attributes:
        name: What is off, and to which side.
        unit: ``mm`` or ``°``; ``×`` for a factor.
        held: Largest error with which it still closes and holds, as did every smaller one that was tried, in every
            direction; 0, or a factor of 1, if none does.
        lost: Smallest error with which it does not; None if it holds up to the largest that was tried.
        samples: Directions that were tried of each error.
        cause: What goes wrong there; empty if nothing does.
    """

    name: str
    unit: str
    held: float
    lost: float | None
    samples: int
    cause: str


def static_loss(grasp: Grasp, path: ReferencePath) -> str | None:
    """Return why a hand loses the object by the quasi-static closing; None if it holds pushes of the load cases."""
    report = close_grasp(grasp, path, safety=1.0)
    return None if report.holds else report.text.partition(": ")[2]


def closing_tolerances(
    grasp: Grasp, *, seed: int = 0, samples: int = 8, loss: Loss = static_loss
) -> tuple[ClosingTolerance, ...]:
    """Return how far palm, size, friction and mass may be off.

    Args:
        grasp: The grasp.
        seed: Seed of the directions in which the palm is off.
        samples: Number of these directions.
        loss: What judges a closing.

    Returns:
        A tolerance for the palm's place and turn, and two, larger and smaller, for size, friction and mass; for size
        none of objects that can't be made larger.
    """
    positive_whole("samples", samples)
    ways = np.random.default_rng(seed).normal(size=(samples, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    thing = grasp.problem.grasp_object
    planned = loss(grasp, grasp.closing.path)
    judged: Loss = loss if planned is None else lambda *_: f"as planned: {planned}"
    found = [
        _tolerance(grasp, "palm shifted", "mm", 1e3 * MOST_SHIFT, _shifted, ways, judged),
        _tolerance(grasp, "palm turned", "°", MOST_TURN_DEG, _turned, ways, judged),
    ]
    for word, sign in (("larger", 1.0), ("smaller", -1.0)):
        if resized(thing, 1e-4) != thing:
            most = 1e3 * MOST_SIZE
            found.append(_tolerance(grasp, f"surface, {word}", "mm", most, _grown(sign), ways[:1], judged))
    for name, change in (("friction", _rougher), ("mass", _heavier)):
        for word, sign in (("larger", 1.0), ("smaller", -1.0)):
            off = _powered(change, sign)
            each = _tolerance(grasp, f"{name}, {word}", "×", np.log(MOST_FACTOR), off, ways[:1], judged)
            lost = None if each.lost is None else float(np.exp(sign * each.lost))
            found.append(replace(each, held=float(np.exp(sign * each.held)), lost=lost))
    return tuple(found)


def _tolerance(grasp: Grasp, name: str, unit: str, most: float, off: Off, ways: Array, loss: Loss) -> ClosingTolerance:
    """Double an error until the grasp is lost, then halve the bracket."""
    held, lost, cause, error = 0.0, None, "", FIRST * most
    while held < most and (lost is None or lost - held > ACCURACY * lost):
        why = _first_loss(grasp, error, off, ways, loss)
        if why is None:
            held = error
        else:
            lost, cause = error, why
            if lost <= LEAST * most:
                break
        error = min(2.0 * held, most) if lost is None else (held + lost) / 2.0
    return ClosingTolerance(name, unit, held, lost, len(ways), cause)


def _first_loss(grasp: Grasp, error: float, off: Off, ways: Array, loss: Loss) -> str | None:
    """Return why the grasp is lost in the first direction in which it is; None if it is in none."""
    for way in ways:
        try:
            tried = off(grasp, error, way)
        except InvalidValueError:
            return "there is no such object"
        why = loss(tried, grasp.closing.path)
        if why is not None:
            return why
    return None


def _shifted(grasp: Grasp, error: float, way: Array) -> Grasp:
    """Return the grasp with its palm shifted [mm]."""
    return palm_moved(grasp, 1e-3 * error * way, np.zeros(3))


def _turned(grasp: Grasp, error: float, way: Array) -> Grasp:
    """Return the grasp with its palm turned about its own origin [degrees]."""
    return palm_moved(grasp, np.zeros(3), np.radians(error) * way)


def _grown(sign: float) -> Off:
    """Return what moves the object's surface out or in [mm]."""
    return lambda grasp, error, _: grown(grasp, sign * 1e-3 * error)


def _powered(change: Callable[[Grasp, float], Grasp], sign: float) -> Off:
    """Return what changes something by a factor, of which the error is the logarithm."""
    return lambda grasp, error, _: change(grasp, float(np.exp(sign * error)))


def _rougher(grasp: Grasp, factor: float) -> Grasp:
    """Return the grasp with another friction at every contact."""
    parameters = grasp.problem.parameters
    given = np.asarray(parameters.friction) * factor
    friction = float(given) if given.ndim == 0 else tuple(float(value) for value in given)
    return replace(grasp, problem=replace(grasp.problem, parameters=replace(parameters, friction=friction)))


def _heavier(grasp: Grasp, factor: float) -> Grasp:
    """Return the grasp with an object of another mass."""
    thing = grasp.problem.grasp_object
    changed = replace(thing, mass=factor * thing.mass)  # type: ignore[call-arg]
    return replace(grasp, problem=replace(grasp.problem, grasp_object=changed))
