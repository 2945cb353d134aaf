"""The feasible grasps of a search: the best first, each once; those that close before others if so asked."""

from __future__ import annotations

import math

import numpy as np

from ..grasp.grasp import Grasp

SAME_PLACE, SAME_ANGLE = 1e-3, 5e-3
"""Distance of palms [m], of joint angles [rad] and of entries of the palms' rotations within which grasps are one."""
ALIKE_ANGLE, ALIKE_PLACE = 0.05, 0.005
"""Root mean square distances of joint angles [rad] and of contact points [m] below which two grasps are alike."""
MOST_KEPT = 256
"""Different grasps that are kept; beyond them the best half of those no two of which are alike."""


def feasible_rank(grasp: Grasp, most_force: float = math.inf) -> tuple[float, ...]:
    """Return what feasible grasps are ordered by, the best first.

    F of those that take too much; the objective to three digits; of equally good ones the angle between the first
    task and its ellipsoid in whole degrees, then the iterations it took.

    Args:
        grasp: A feasible grasp.
        most_force: F that a grasp may take [N].
    """
    angle, _ = grasp.alignments[0]
    iterations = grasp.search.iterations if grasp.search is not None else 0
    return (
        _excess(grasp, most_force),
        float(f"{grasp.objective:.2e}"),
        round(angle) if math.isfinite(angle) else 180,
        iterations,
    )


def _excess(grasp: Grasp, most_force: float) -> float:
    """Return F of a grasp that takes too much, otherwise 0."""
    return grasp.force_norm if grasp.force_norm > most_force * (1.0 + 1e-6) else 0.0


def same_grasp(first: Grasp, second: Grasp) -> bool:
    """Return whether two grasps of a problem are one found twice."""
    if np.abs(first.joint_angles - second.joint_angles).max() >= SAME_ANGLE:
        return False
    place = float(np.linalg.norm(first.palm_pose.translation - second.palm_pose.translation))
    turned = float(np.abs(first.palm_pose.rotation - second.palm_pose.rotation).max())
    return place < SAME_PLACE and turned < SAME_ANGLE


def alike(first: Grasp, second: Grasp) -> bool:
    """Return whether two grasps of a problem are so near in posture and contact points that a user sees one."""
    turn = first.joint_angles - second.joint_angles
    if turn @ turn >= ALIKE_ANGLE**2 * turn.size:
        return False
    apart = first.contacts.points - second.contacts.points
    return bool(np.vdot(apart, apart) < ALIKE_PLACE**2 * len(apart))


class FoundGrasps:
    """The feasible grasps of a search.

    Attributes:
        count: How many were found, those found again included.
    """

    def __init__(self) -> None:
        self.count = 0
        self._different: list[Grasp] = []

    @property
    def different(self) -> int:
        """How many different ones were found."""
        return len(self._different)

    def keep(self, grasp: Grasp, most_force: float = math.inf) -> None:
        """Keep a grasp; of one found twice the better one stays."""
        self.count += 1
        for index, other in enumerate(self._different):
            if same_grasp(grasp, other):
                if feasible_rank(grasp) < feasible_rank(other):
                    self._different[index] = grasp
                return
        self._different.append(grasp)
        if len(self._different) > MOST_KEPT:
            self._different = list(self.best(MOST_KEPT // 2, closing=False, most_force=most_force))

    def ranked(self, most_force: float = math.inf) -> list[Grasp]:
        """Return the different grasps, the best first."""
        return sorted(self._different, key=lambda grasp: feasible_rank(grasp, most_force))

    def first(self, most_force: float = math.inf) -> Grasp | None:
        """Return the best grasp, None if there is none."""
        return next(iter(self.ranked(most_force)), None)

    def first_closing(self, most_force: float = math.inf, *, gentle: bool = False) -> Grasp | None:
        """Return the best of those that close from an open hand, None if none does; worse ones are not looked at.

        Args:
            most_force: F that a grasp may take [N].
            gentle: Whether only those count that take no more.
        """
        ranked = (grasp for grasp in self.ranked(most_force) if not gentle or not _excess(grasp, most_force))
        return next((grasp for grasp in ranked if grasp.closing.holds), None)

    def best(self, count: int, *, closing: bool, most_force: float = math.inf) -> tuple[Grasp, ...]:
        """Return the best grasps of which no two are alike, at most so many; if so asked those that close first."""
        if count == 1:
            chosen = (self.first_closing(most_force) if closing else None) or self.first(most_force)
            return () if chosen is None else (chosen,)
        ordered = self.ranked(most_force)
        if closing:
            ordered.sort(key=lambda grasp: not grasp.closing.holds)
        found: list[Grasp] = []
        for grasp in ordered:
            if len(found) < count and not any(alike(grasp, each) for each in found):
                found.append(grasp)
        return tuple(found)
