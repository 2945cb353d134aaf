"""The feasible grasps of a search: the best first, each once; those that close before others if so asked."""

from __future__ import annotations

import math

import numpy as np

from ..grasp.grasp import Grasp, find_closings

SAME_PLACE, SAME_ANGLE = 1e-3, 5e-3
"""Distance of palms [m], of joint angles [rad] and of entries of the palms' rotations within which grasps are one."""
ALIKE_ANGLE, ALIKE_PLACE = 0.05, 0.005
"""Root mean square distances of joint angles [rad] and of contact points [m] below which two grasps are alike."""
MORE_ANGLE_DEG, MORE_COST = 5.0, 4.0
"""Angle that a task may lose against its ellipsoid [degrees], and factor by which the objective may grow, for fingers
that slide less while they close: a task is then transmitted at least half as well."""
TOGETHER = 8
"""Grasps of which it is looked at together how they close."""
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


def serves_nearly(grasp: Grasp, other: Grasp, more_cost: float) -> bool:
    """Return whether a grasp serves every task, and other costs, nearly as well as another one.

    Args:
        grasp: The grasp.
        other: The other one, of a problem without weights.
        more_cost: Factor by which the objective may be larger.
    """
    angles = zip(grasp.alignments, other.alignments, strict=True)
    near = all(mine <= its + MORE_ANGLE_DEG or math.isnan(its) for (mine, _), (its, _) in angles)
    return near and grasp.objective <= more_cost * other.objective


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

    def closing(self, most_force: float = math.inf) -> list[Grasp]:
        """Return of the best grasps those that close from an open hand, the best first; F is at most ``most_force``.

        So many are looked at together, and worse ones only where none of these closes.
        """
        ranked = [grasp for grasp in self.ranked(most_force) if not _excess(grasp, most_force)]
        for begin in range(0, len(ranked), TOGETHER):
            tried = ranked[begin : begin + TOGETHER]
            find_closings(tried)
            found = [grasp for grasp in tried if grasp.closing.holds]
            if found:
                return found
        return []

    def surest_closing(self, most_force: float = math.inf) -> Grasp | None:
        """Return the one that closes most surely of those that serve every task nearly as well as the best that closes.

        That is one that closes around an object that nothing holds, before all others, and then the one whose fingers
        slide least: fingers that arrive where they were planned still do so, more or less, where the palm or the object
        is a little off. With weights it is the best that closes; None if none does.
        """
        closing = self.closing(most_force)
        if not closing or closing[0].problem.parameters.weighted:
            return next(iter(closing), None)
        near = (grasp for grasp in closing if grasp is closing[0] or serves_nearly(grasp, closing[0], MORE_COST))
        return min(near, key=lambda grasp: (not grasp.closing.holds_free, float(grasp.closing.slip.max())))

    def best(self, count: int, *, closing: bool, most_force: float = math.inf) -> tuple[Grasp, ...]:
        """Return the best grasps of which no two are alike, at most so many.

        Args:
            count: How many.
            closing: Whether those that close go first, :meth:`surest_closing` before them all.
            most_force: F that a grasp may take [N].
        """
        ordered = self.ranked(most_force)
        surest = self.surest_closing(most_force) if closing else None
        if closing and (count > 1 or surest is None):
            find_closings(ordered)
            ordered.sort(key=lambda grasp: not grasp.closing.holds)
        if surest is not None:
            ordered.sort(key=lambda grasp: grasp is not surest)
        found: list[Grasp] = []
        for grasp in ordered:
            if len(found) < count and not any(alike(grasp, each) for each in found):
                found.append(grasp)
        return tuple(found)
