"""Fingers given by Denavit–Hartenberg parameters, as SynGrasp has them: frames, points along links, Jacobians.

For hands that exist only as such a table. The standard convention: from link to link Rot_z(θ) Trans_z(d) Trans_x(a)
Rot_x(α); [Siciliano2009] section 2.8.2. A hand to plan with is a URDF.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..checks import finite_array
from ..exceptions import InvalidValueError
from ..spatial import Array
from ..values import Value


@dataclass(frozen=True, eq=False, repr=False)
class DhFinger(Value):
    """A finger of n joints that turn.

    Attributes:
        base: Pose of its base, homogeneous, of shape (4, 4) [1; m].
        table: α [rad], a [m], θ [rad], d [m] of each link, of shape (n, 4); θ is the joint's angle.
    """

    base: Array
    table: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "base", finite_array("base", self.base, (4, 4)))
        object.__setattr__(self, "table", finite_array("table", self.table, (len(self.table), 4)))

    def moved(self, q: npt.ArrayLike) -> DhFinger:
        """Return the finger at joint angles [rad], of shape (n,)."""
        table = np.array(self.table)
        table[:, 2] = finite_array("q", q, (len(table),))
        return DhFinger(self.base, table)

    @property
    def frames(self) -> Array:
        """Frames of base, links and tip, homogeneous, of shape (n + 1, 4, 4); joint k turns about z of frame k."""
        found = [np.asarray(self.base)]
        for alpha, a, theta, d in self.table:
            cos_t, sin_t, cos_a, sin_a = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
            step = [
                [cos_t, -sin_t * cos_a, sin_t * sin_a, a * cos_t],
                [sin_t, cos_t * cos_a, -cos_t * sin_a, a * sin_t],
                [0.0, sin_a, cos_a, d],
                [0.0, 0.0, 0.0, 1.0],
            ]
            found.append(found[-1] @ np.array(step))
        return np.array(found)

    def point(self, link: int, share: float) -> Array:
        """Return a point of a link, counted from 0, at a share of the way from its joint to the next, of shape (3,)."""
        if not 0 <= link < len(self.table):
            raise InvalidValueError("link", link, f"0 to {len(self.table) - 1}")
        origins = self.frames[:, :3, 3]
        return np.asarray(origins[link] + share * (origins[link + 1] - origins[link]))

    def twist(self, link: int, point: Array) -> Array:
        """Return how a point of a link moves by the joints: velocity, then angular velocity, of shape (6, n)."""
        frames = self.frames[: link + 1]
        axes, found = frames[:, :3, 2], np.zeros((6, len(self.table)))
        found[:3, : link + 1] = np.cross(axes, point - frames[:, :3, 3]).T
        found[3:, : link + 1] = axes.T
        return found


def dh_twists(fingers: Sequence[DhFinger], contacts: Sequence[tuple[int, int, float]]) -> tuple[Array, Array]:
    """Return contact points of a hand of such fingers, and their twists by all joints, finger by finger.

    ``model.complete_jacobian`` makes J̃ of the twists, ``model.contact_selection`` H: J = H J̃.

    Args:
        fingers: The fingers.
        contacts: Finger, link (both from 0) and share of the way along the link of each contact.

    Returns:
        Points [m], of shape (n_c, 3), and twists, of shape (n_c, 6, n_q).
    """
    first = np.cumsum([0, *(len(finger.table) for finger in fingers)])
    points, twists = np.zeros((len(contacts), 3)), np.zeros((len(contacts), 6, first[-1]))
    for i, (which, link, share) in enumerate(contacts):
        points[i] = fingers[which].point(link, share)
        twists[i, :, first[which] : first[which + 1]] = fingers[which].twist(link, points[i])
    return points, twists
