"""Human postures to robot postures by what the fingertips do: scaled fingertip vectors and opposition of the thumb.

The robot's posture is found by inverse kinematics, in the way of F. Ficuciello, G. Palli, C. Melchiorri,
B. Siciliano ("Postural synergies of the UB Hand IV for human-like grasping", Robotics and Autonomous Systems 62,
2014), who map measured human fingertips to a robot hand and take the principal components there. Three things are
asked of it, in the sense of least squares, within the joint limits:

* each of the four fingers reaches, from its own base, the human fingertip scaled by the ratio of finger lengths;
* the vectors from the thumb's tip to the other four tips are the scaled human ones, in one of two senses. A robot's
  thumb may stand elsewhere than a human one, for instance in front of the palm instead of beside it, and then opposes
  in another direction within the planes of the fingers; a free wrist makes up for that. So either all vectors are
  turned by one fixed angle about the hand's y axis, or only what does not depend on such a tilt counts: their
  lengths and their y components;
* a little pull towards a rest posture, which decides what is left open.

This module knows no robot: it takes any function that returns fingertip positions and their Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from ..checks import finite_array, positive
from ..exceptions import InvalidValueError
from ..spatial import Array, readonly, rotation_exp

FingertipFunction = Callable[[Array], tuple[Array, Array]]
"""q [rad] (n_q,) -> fingertips [m] (5, 3) and their Jacobian [m/rad] (5, 3, n_q), palm frame, thumb first."""

_LENGTH = 0.01  # residuals of positions are counted in centimetres
_SMALLEST_DISTANCE = 1e-5  # [m], smooths |v| at 0


@dataclass(frozen=True)
class FingerCorrespondence:
    """How a human hand is laid over a robot hand; both in palm frames with equal axes.

    Attributes:
        human_bases: Where the four fingers' vectors start on the human hand [m], of shape (4, 3).
        robot_bases: Where they start on the robot hand [m], of shape (4, 3).
        finger_scale: Robot over human length of each finger, of shape (4,).
        opposition_scale: Scale of the vectors from the thumb's tip to the other tips.
        opposition_tilt: Angle by which these are turned about y [rad], negative where the robot's thumb stands
            farther in front of the palm; None if only their lengths and y components count.
    """

    human_bases: Array
    robot_bases: Array
    finger_scale: Array
    opposition_scale: float
    opposition_tilt: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "human_bases", finite_array("human_bases", self.human_bases, (4, 3)))
        object.__setattr__(self, "robot_bases", finite_array("robot_bases", self.robot_bases, (4, 3)))
        scale = finite_array("finger_scale", self.finger_scale, (4,))
        if not (scale > 0.0).all():
            raise InvalidValueError("finger_scale", scale.tolist(), "numbers > 0")
        object.__setattr__(self, "finger_scale", scale)
        positive("opposition_scale", self.opposition_scale)
        if self.opposition_tilt is not None and not np.isfinite(self.opposition_tilt):
            raise InvalidValueError("opposition_tilt", self.opposition_tilt, "a finite angle [rad], or None")

    def targets(self, human_tips: Array) -> tuple[Array, Array]:
        """Return what a robot posture has to meet.

        Args:
            human_tips: Human fingertips [m], thumb first, of shape (5, 3).

        Returns:
            Positions for the four fingertips [m], and the vectors from the thumb's tip to them [m], each of
            shape (4, 3).
        """
        fingers = self.robot_bases + self.finger_scale[:, None] * (human_tips[1:] - self.human_bases)
        turn = rotation_exp(np.array([0.0, self.opposition_tilt or 0.0, 0.0]))
        return fingers, self.opposition_scale * (human_tips[1:] - human_tips[0]) @ turn.T


@dataclass(frozen=True)
class RetargetingWeights:
    """What counts how much; positions are counted in centimetres, angles in radians.

    Attributes:
        fingers: Weight of the four fingers' own vectors.
        opposition: Weights of the thumb's vectors to index, middle, ring and little finger.
        rest: Weight of the pull towards the rest posture, one number or one for each joint.
    """

    fingers: float = 1.0
    opposition: tuple[float, float, float, float] = (1.0, 1.0, 0.5, 0.5)
    rest: float | tuple[float, ...] = 0.5

    def __post_init__(self) -> None:
        positive("fingers", self.fingers, zero_allowed=True)
        for weight in np.atleast_1d(self.rest):
            positive("rest", weight)
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
        opposition_errors: Errors of the four distances of the thumb [m], signed, of shape (N, 4).
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

    Every posture is solved from the rest posture, so that the result does not depend on the order of the
    postures and the thumb stays on the side it starts from.

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
        problem = _Posture(fingertips, correspondence, human, start, weights)
        postures[row] = problem.solve(lower, upper)
        finger_errors[row], opposition_errors[row] = problem.errors(postures[row])
    return Retargeting(readonly(postures), readonly(finger_errors), readonly(opposition_errors))


class _Posture:
    """The least-squares problem of one posture."""

    def __init__(
        self,
        fingertips: FingertipFunction,
        correspondence: FingerCorrespondence,
        human: Array,
        rest: Array,
        weights: RetargetingWeights,
    ) -> None:
        self.fingertips, self.rest = fingertips, rest
        self.finger_target, self.opposition_target = correspondence.targets(human)
        self.any_tilt = correspondence.opposition_tilt is None
        self.distance = _smooth_norm(self.opposition_target)
        self.finger_weight = weights.fingers / _LENGTH
        self.opposition_weight = np.array(weights.opposition) / _LENGTH
        if np.size(weights.rest) not in (1, len(rest)):
            raise InvalidValueError("rest", weights.rest, f"one weight, or {len(rest)}")
        self.rest_weight = np.broadcast_to(weights.rest, len(rest))

    def solve(self, lower: Array, upper: Array) -> Array:
        """Return the posture, of shape (n_q,)."""
        inside = 1e-6 * (upper - lower)
        start = np.clip(self.rest, lower + inside, upper - inside)
        return least_squares(self.residuals, start, jac=self.jacobian, bounds=(lower, upper), max_nfev=200).x

    def residuals(self, q: Array) -> Array:
        """Return the weighted residuals."""
        position, _ = self.fingertips(q)
        across = position[1:] - position[0]
        return np.concatenate(
            [
                self.finger_weight * (position[1:] - self.finger_target).ravel(),
                (self.opposition_weight[:, None] * self._opposition(across)).ravel(),
                self.rest_weight * (q - self.rest),
            ]
        )

    def jacobian(self, q: Array) -> Array:
        """Return the derivatives of the residuals."""
        position, jacobian = self.fingertips(q)
        across, moving = position[1:] - position[0], jacobian[1:] - jacobian[0]
        if self.any_tilt:
            direction = across / _smooth_norm(across)[:, None]
            moving = np.stack([np.einsum("fi,fij->fj", direction, moving), moving[:, 1]], axis=1)
        n_q = len(q)
        return np.vstack(
            [
                self.finger_weight * jacobian[1:].reshape(-1, n_q),
                (self.opposition_weight[:, None, None] * moving).reshape(-1, n_q),
                np.diag(self.rest_weight),
            ]
        )

    def _opposition(self, across: Array) -> Array:
        """Return the errors of the thumb's vectors [m]: of shape (4, 3), or (4, 2) for length and y."""
        if not self.any_tilt:
            return across - self.opposition_target
        return np.column_stack([_smooth_norm(across) - self.distance, across[:, 1] - self.opposition_target[:, 1]])

    def errors(self, q: Array) -> tuple[Array, Array]:
        """Return the errors of the fingertips and of the thumb's distances [m], each of shape (4,)."""
        position, _ = self.fingertips(q)
        distance = np.linalg.norm(position[1:] - position[0], axis=1)
        wanted = np.linalg.norm(self.opposition_target, axis=1)
        return np.linalg.norm(position[1:] - self.finger_target, axis=1), distance - wanted


def _smooth_norm(vectors: Array) -> Array:
    """Return lengths of vectors (..., 3), differentiable at zero [m]."""
    return np.sqrt((vectors * vectors).sum(axis=-1) + _SMALLEST_DISTANCE**2)
