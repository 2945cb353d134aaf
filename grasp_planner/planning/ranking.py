"""The feasible grasps of a search: the best first, each once; those that close before others if so asked."""

from __future__ import annotations

import math

import numpy as np

from ..grasp.grasp import Grasp

SAME_PLACE, SAME_ANGLE = 1e-3, 5e-3
"""Distance of palms [m], of joint angles [rad] and of entries of the palms' rotations within which grasps are one."""


def feasible_rank(grasp: Grasp) -> tuple[float, ...]:
    """Return what feasible grasps are ordered by, the best first.

    The objective to three digits; of equally good ones the angle between the first task and its ellipsoid in whole
    degrees, then the iterations it took.
    """
    angle, _ = grasp.alignments[0]
    iterations = grasp.search.iterations if grasp.search is not None else 0
    return float(f"{grasp.objective:.2e}"), round(angle) if math.isfinite(angle) else 180, iterations


def same_grasp(first: Grasp, second: Grasp) -> bool:
    """Return whether two grasps of a problem are one found twice."""
    place = float(np.linalg.norm(first.palm_pose.translation - second.palm_pose.translation))
    turned = float(np.abs(first.palm_pose.rotation - second.palm_pose.rotation).max())
    bent = float(np.abs(first.joint_angles - second.joint_angles).max())
    return place < SAME_PLACE and max(turned, bent) < SAME_ANGLE


class FoundGrasps:
    """The feasible grasps of a search.

    Attributes:
        count: How many were found, those found again included.
    """

    def __init__(self) -> None:
        self.count = 0
        self._different: list[tuple[tuple[float, ...], Grasp]] = []

    @property
    def different(self) -> int:
        """How many different ones were found."""
        return len(self._different)

    def keep(self, grasp: Grasp) -> None:
        """Keep a grasp; of one found twice the better one stays."""
        self.count += 1
        rank = feasible_rank(grasp)
        for index, (known, other) in enumerate(self._different):
            if same_grasp(grasp, other):
                if rank < known:
                    self._different[index] = rank, grasp
                return
        self._different.append((rank, grasp))

    def ranked(self) -> list[Grasp]:
        """Return the different grasps, the best first."""
        return [grasp for _, grasp in sorted(self._different, key=lambda each: each[0])]

    def first(self) -> Grasp | None:
        """Return the best grasp, None if there is none."""
        return next(iter(self.ranked()), None)

    def first_closing(self) -> Grasp | None:
        """Return the best of those that close from an open hand, None if none does; worse ones are not looked at."""
        return next((grasp for grasp in self.ranked() if grasp.closing.holds), None)
