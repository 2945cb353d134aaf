"""Human postures to robot postures by what the fingertips do: scaled fingertip vectors and opposition of the thumb.

The robot's posture is found by inverse kinematics, in the way of F. Ficuciello, G. Palli, C. Melchiorri,
B. Siciliano ("Postural synergies of the UB Hand IV for human-like grasping", Robotics and Autonomous Systems 62,
2014), who map measured human fingertips to a robot hand and take the principal components there. Three things are
asked of it, in the sense of least squares, within the joint limits:

* each of the four fingers reaches, from its own base, the scaled human fingertip;
* the vectors from the thumb's tip to the other four tips are the scaled human ones, turned by a fixed angle about
  the hand's y axis. A robot's thumb may stand elsewhere than a human one, for instance in front of the palm instead
  of beside it; it then opposes in another direction within the planes of the fingers, and a free wrist makes up
  for that;
* a little pull towards a rest posture, which decides what is left open.

This module knows no robot: it takes any function that returns fingertip positions and their Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from .exceptions import InvalidValueError
from .spatial import Array, finite_array, positive, readonly, rotation_exp

FingertipFunction = Callable[[Array], tuple[Array, Array]]
"""q [rad] (n_q,) -> fingertips [m] (5, 3) and their Jacobian [m/rad] (5, 3, n_q), palm frame, thumb first."""

_LENGTH = 0.01  # residuals of positions are counted in centimetres


@dataclass(frozen=True)
class FingerCorrespondence:
    """How a human hand is laid over a robot hand; both in palm frames with equal axes.

    Attributes:
        human_bases: Where the four fingers' vectors start on the human hand [m], of shape (4, 3).
        robot_bases: Where they start on the robot hand [m], of shape (4, 3).
        scale: Robot over human size.
        opposition_tilt: Angle by which the vectors from the thumb to the fingers are turned about y [rad]; negative
            where the robot's thumb stands farther in front of the palm.
    """

    human_bases: Array
    robot_bases: Array
    scale: float = 1.0
    opposition_tilt: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "human_bases", finite_array("human_bases", self.human_bases, (4, 3)))
        object.__setattr__(self, "robot_bases", finite_array("robot_bases", self.robot_bases, (4, 3)))
        positive("scale", self.scale)
        if not np.isfinite(self.opposition_tilt):
            raise InvalidValueError("opposition_tilt", self.opposition_tilt, "a finite angle [rad]")

    def targets(self, human_tips: Array) -> tuple[Array, Array]:
        """Return what a robot posture has to meet.

        Args:
            human_tips: Human fingertips [m], thumb first, of shape (5, 3).

        Returns:
            Positions for the four fingertips [m], of shape (4, 3), and for the vectors from the thumb's tip to them
            [m], of shape (4, 3).
        """
        fingers = self.robot_bases + self.scale * (human_tips[1:] - self.human_bases)
        turn = rotation_exp(np.array([0.0, self.opposition_tilt, 0.0]))
        return fingers, self.scale * (human_tips[1:] - human_tips[0]) @ turn.T


@dataclass(frozen=True)
class RetargetingWeights:
    """What counts how much; positions are counted in centimetres, angles in radians.

    Attributes:
        fingers: Weight of the four fingers' own vectors.
        opposition: Weights of the vectors from the thumb to index, middle, ring and little finger.
        rest: Weight of the pull towards the rest posture.
    """

    fingers: float = 1.0
    opposition: tuple[float, float, float, float] = (1.0, 1.0, 0.5, 0.5)
    rest: float = 0.5

    def __post_init__(self) -> None:
        positive("fingers", self.fingers, zero_allowed=True)
        positive("rest", self.rest)
        if len(self.opposition) != 4:
            raise InvalidValueError("opposition", self.opposition, "four weights")
        for weight in self.opposition:
            positive("opposition", weight, zero_allowed=True)


@dataclass(frozen=True)
class Retargeting:
    """Robot postures found for human ones.

    Attributes:
        joint_angles: Robot postures [rad], of shape (N, n_q).
        finger_errors: Distances of the four fingertips from their targets [m], of shape (N, 4).
        opposition_errors: Distances of the four vectors from the thumb from theirs [m], of shape (N, 4).
    """

    joint_angles: Array
    finger_errors: Array
    opposition_errors: Array


def retarget_postures(
    fingertips: FingertipFunction,
    limits: tuple[npt.ArrayLike, npt.ArrayLike],
    human_tips: npt.ArrayLike,
    correspondence: FingerCorrespondence,
    rest: npt.ArrayLike,
    weights: RetargetingWeights | None = None,
) -> Retargeting:
    """Find the robot postures that do with the fingertips what human postures do.

    Every posture is solved from the rest posture, so that the result does not depend on their order.

    Args:
        fingertips: The robot's fingertips and their Jacobian; see :data:`FingertipFunction`.
        limits: Lower and upper joint limits [rad], each of shape (n_q,), lower < upper.
        human_tips: Human fingertips [m], thumb first, palm frame, of shape (N, 5, 3).
        correspondence: How the hands are laid over each other.
        rest: Robot posture to start from and to be pulled to [rad], of shape (n_q,).
        weights: What counts how much.

    Returns:
        Postures within the limits, and how well they meet their targets.

    Raises:
        InvalidValueError: If shapes do not fit, numbers are not finite or a limit is not below the other.
    """
    weights = weights or RetargetingWeights()
    n_q = np.size(rest)
    start = finite_array("rest", rest, (n_q,))
    lower, upper = finite_array("lower limit", limits[0], (n_q,)), finite_array("upper limit", limits[1], (n_q,))
    if not (lower < upper).all():
        raise InvalidValueError("limits", (lower.tolist(), upper.tolist()), "lower < upper for every joint")
    tips = np.asarray(human_tips, dtype=float)
    tips = finite_array("human_tips", tips, (tips.shape[0] if tips.ndim else 0, 5, 3))
    postures = np.empty((len(tips), n_q))
    finger_errors, opposition_errors = np.empty((len(tips), 4)), np.empty((len(tips), 4))
    for row, human in enumerate(tips):
        problem = _Posture(fingertips, correspondence.targets(human), start, weights)
        postures[row] = problem.solve(lower, upper)
        finger_errors[row], opposition_errors[row] = problem.errors(postures[row])
    return Retargeting(readonly(postures), readonly(finger_errors), readonly(opposition_errors))


class _Posture:
    """The least-squares problem of one posture."""

    def __init__(
        self,
        fingertips: FingertipFunction,
        targets: tuple[Array, Array],
        rest: Array,
        weights: RetargetingWeights,
    ) -> None:
        self.fingertips, self.rest = fingertips, rest
        self.finger_target, self.opposition_target = targets
        self.finger_weight = weights.fingers / _LENGTH
        self.opposition_weight = np.array(weights.opposition)[:, None] / _LENGTH
        self.rest_weight = weights.rest

    def solve(self, lower: Array, upper: Array) -> Array:
        """Return the posture, of shape (n_q,)."""
        inside = 1e-6 * (upper - lower)
        start = np.clip(self.rest, lower + inside, upper - inside)
        return least_squares(self.residuals, start, jac=self.jacobian, bounds=(lower, upper), max_nfev=200).x

    def residuals(self, q: Array) -> Array:
        """Return the weighted residuals."""
        position, _ = self.fingertips(q)
        return np.concatenate(
            [
                self.finger_weight * (position[1:] - self.finger_target).ravel(),
                (self.opposition_weight * (position[1:] - position[0] - self.opposition_target)).ravel(),
                self.rest_weight * (q - self.rest),
            ]
        )

    def jacobian(self, q: Array) -> Array:
        """Return the derivatives of the residuals."""
        _, jacobian = self.fingertips(q)
        n_q = len(q)
        return np.vstack(
            [
                self.finger_weight * jacobian[1:].reshape(12, n_q),
                (self.opposition_weight[..., None] * (jacobian[1:] - jacobian[0])).reshape(12, n_q),
                self.rest_weight * np.eye(n_q),
            ]
        )

    def errors(self, q: Array) -> tuple[Array, Array]:
        """Return the errors of the fingertips and of the thumb's vectors [m], each of shape (4,)."""
        position, _ = self.fingertips(q)
        across = position[1:] - position[0]
        return (
            np.linalg.norm(position[1:] - self.finger_target, axis=1),
            np.linalg.norm(across - self.opposition_target, axis=1),
        )
