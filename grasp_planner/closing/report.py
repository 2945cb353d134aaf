"""What is known of a closing hand: touches, the state of rest and pushes, and whether it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..spatial import Array
from ..values import Value
from .path import ReferencePath

OPEN_OVERLAP = 1e-3
"""Deepest overlap of the open hand with itself or the object with which a closing may begin [m], as in simulation."""


@dataclass(frozen=True, eq=False, repr=False)
class ClosingReport(Value):
    """How a grasp closes from an open hand, and whether it then holds; frame O of the plan.

    Attributes:
        path: The references from the open hand to the plan's, the best of several ways.
        pregrasp: Posture of the open hand, the palm where it is planned [rad], of shape (n_q,).
        names: Names of the contacts.
        times: When each finger touches: 0 open, 1 the touching references, 2 the plan's; infinite without a touch.
        points: Where each finger first touches the object, or where the surface is nearest [m], of shape (n_c, 3).
        mismatch: Distance of these points from the planned contacts [m], of shape (n_c,).
        mismatch_force: The same by the stiffness of the fingers, the palm and the references held [N], of shape (n_c,).
        forces: Of the hand on the object at rest, the object free [N], of shape (n_c, 3); nan if it is lost.
        cone_use: |f_t|/(μ f_n) at rest, 0 without contact, of shape (n_c,).
        slip: How far each contact slid over the object, closing and release together [m], of shape (n_c,).
        overlap: Deepest overlap of a link that is no contact with the object or another link at rest [m].
        displacement: Of the object at rest [m].
        rotation: Of the object at rest [rad].
        torque_use: Largest share of a joint's torque limit at rest.
        pushes: How far a push along ±x, ±y, ±z moves it [m]; infinite where it is lost, of shape (6,).
        push: How strong these pushes are, unless told otherwise a half more than the load cases ask for [N].
        holds_free: Whether it also holds pushes as strong as the load cases where nothing holds the object while the
            hand closes; None where that was not looked at.
    """

    path: ReferencePath
    pregrasp: Array
    names: tuple[str, ...]
    times: Array
    points: Array
    mismatch: Array
    mismatch_force: Array
    forces: Array
    cone_use: Array
    slip: Array
    overlap: float
    displacement: float
    rotation: float
    torque_use: float
    pushes: Array
    push: float
    holds_free: bool | None = None

    @property
    def order(self) -> tuple[str, ...]:
        """Names of the fingers that touch, the first first."""
        return tuple(self.names[i] for i in np.argsort(self.times, kind="stable") if np.isfinite(self.times[i]))

    @property
    def rests(self) -> bool:
        """Whether the hand, closed, has the object at rest."""
        return bool(np.isfinite(self.displacement))

    @property
    def holds(self) -> bool:
        """Whether the open hand is free, closes within its torques and then holds every push."""
        return self.opens and self.rests and self.torque_use <= 1.0 and bool(np.isfinite(self.pushes).all())

    @property
    def opens(self) -> bool:
        """Whether the open hand overlaps neither the object nor itself."""
        return self.path.overlap <= OPEN_OVERLAP

    @property
    def worth_squeezing(self) -> bool:
        """Whether it only lacks force: the object rests, but is lost by a push."""
        return self.opens and self.rests and not self.holds

    @property
    def rank(self) -> tuple[float, ...]:
        """What ways of closing are ordered by, the best first: opens, rests, pushes held, mismatch."""
        return not self.opens, not self.rests, float(np.isinf(self.pushes).sum()), float(self.mismatch.max())

    @property
    def worst(self) -> int:
        """The contact that touches farthest from the plan."""
        return int(np.argmax(self.mismatch))

    @property
    def text(self) -> str:
        """One sentence."""
        off = f"{self.names[self.worst]} touches {1e3 * self.mismatch[self.worst]:.1f} mm off"
        missing = [name for name, time in zip(self.names, self.times, strict=True) if not np.isfinite(time)]
        if missing:
            off = f"{' and '.join(missing)} would not touch; {off}"
        if self.holds:
            more = "" if self.path.factor == 1.0 else f", squeezing {self.path.factor:g} times the planned way"
            return f"closes from open: {off}, the object moves {1e3 * self.displacement:.1f} mm{more}"
        if not self.opens:
            return f"does not close: the open hand overlaps by {1e3 * self.path.overlap:.1f} mm"
        if 1.0 < self.torque_use < np.inf:
            return f"does not close: a joint would need {100 * self.torque_use:.0f} % of its torque"
        lost = int(np.isinf(self.pushes).sum())
        what = f"{lost} of {len(self.pushes)} pushes of {self.push:g} N lost" if self.rests else "the object is lost"
        return f"does not close: {off}, {what}"
