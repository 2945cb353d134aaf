"""Contacts and hand Jacobian with their derivatives by joint angles and palm pose, in one pass.

The fast form of :func:`grasp_planner.model.contacts.find_contacts` and
:func:`grasp_planner.model.contacts.hand_jacobian`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..hand.kinematics import ContactKinematics, HandKinematics
from ..model.contact_model import HardFinger
from ..objects import SurfaceSample
from ..problem.problem import GraspProblem
from ..spatial import Array, skew
from .contact_basis import HeldBasis
from .variables import PoseChart, VariableLayout


@dataclass(frozen=True)
class ContactGeometry:
    """n_c contacts in O with derivatives by the n_g = n_q + 6 variables (q, w); m = d n_c intensities, 3 n_c forces.

    Attributes:
        rotation: Rotation of the palm in O, of shape (3, 3).
        translation: Position of the palm in O [m], of shape (3,).
        points: Contact points [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        gaps: Gaps [m], of shape (n_c,).
        grasp: Grasp matrix G, of shape (6, m).
        jacobian: Hand Jacobian J [m/rad], of shape (m, n_q).
        d_points: ∂points, of shape (n_c, 3, n_g).
        d_normals: ∂normals, of shape (n_c, 3, n_g).
        d_gaps: ∂gaps, of shape (n_c, n_g).
        d_jacobian: ∂J, of shape (n_g, m, n_q), variable first.
        covectors: ν of the intensities, the normals of hard fingers: f_n = ν·λ, of shape (n_c, d).
        d_covectors: ∂ν, of shape (n_c, d, n_g).
        held: The holding bases; None for hard fingers, whose intensities are the forces.
        turn: Angular velocity of the palm in O per velocity of its rotation coordinates, of shape (3, 3).
        placements: Poses of all joints in the root frame of the hand, of shape (n_joints + 1, 4, 4).
        twists: Their Jacobian columns (linear, angular) about the root's origin, of shape (6, nv).
    """

    rotation: Array
    translation: Array
    points: Array
    normals: Array
    gaps: Array
    grasp: Array
    jacobian: Array
    d_points: Array
    d_normals: Array
    d_gaps: Array
    d_jacobian: Array
    covectors: Array
    d_covectors: Array
    held: HeldBasis | None
    turn: Array
    placements: Array
    twists: Array

    def grasp_products(self, covector: Array, forces: Array) -> tuple[Array, Array]:
        """Return ∂(Gᵀ g) for a fixed covector g and ∂(G f) for fixed forces f.

        Args:
            covector: g, of shape (6,).
            forces: f, or the intensities λ, of shape (m,).

        Returns:
            Arrays of shapes (m, n_g) and (6, n_g).
        """
        if self.held is not None:
            return self.held.products(covector, forces)
        n_c, _, n_g = self.d_points.shape
        d_transpose = (skew(covector[3:]) @ self.d_points).reshape(3 * n_c, n_g)
        d_grasp = np.zeros((6, n_g))
        d_grasp[3:] = -(skew(forces.reshape(n_c, 3)) @ self.d_points).sum(axis=0)
        return d_transpose, d_grasp

    @property
    def d_grasp_rows(self) -> tuple[Array, slice]:
        """∂G, variable first, and which of its rows that is: for hard fingers only those of the moments change."""
        if self.held is not None:
            return self.held.d_grasp(), slice(0, 6)
        n_c, _, n_g = self.d_points.shape
        arms = skew(self.d_points.transpose(2, 0, 1)).transpose(0, 2, 1, 3)
        return arms.reshape(n_g, 3, 3 * n_c), slice(3, 6)


class ContactGeometryEvaluator:
    """Evaluates the contact geometry of a problem; has its own Pinocchio workspace, for one thread."""

    def __init__(self, problem: GraspProblem, chart: PoseChart, like: ContactGeometryEvaluator | None = None) -> None:
        """Make an evaluator; of another one it takes the workspace where that has the same hand and contacts."""
        self.problem = problem
        self.chart = chart
        self.layout = VariableLayout.of(problem)
        shared: HandKinematics | None = None if like is None else like._kinematics
        if shared is None or shared.hand is not problem.hand or shared.frames != tuple(problem.frames):
            shared = HandKinematics(problem.hand, problem.frames)
        self._kinematics: HandKinematics = shared
        self._radii = problem.radii
        self._round = bool(self._radii.any())
        self._model = None if isinstance(problem.contact_model, HardFinger) else problem.contact_model

    def evaluate(self, x: Array) -> ContactGeometry:
        """Evaluate contacts, Jacobian and derivatives.

        Args:
            x: The variables; δσ is not used, of shape (n_x,).

        Returns:
            The contact geometry.
        """
        layout, radii, n_q = self.layout, self._radii, self.layout.n_joints
        w = x[layout.pose]
        rotation, translation = self.chart.pose(w)
        turn = self.chart.turn_jacobian(w)
        turning = self._round or self._model is not None
        kinematics = self._kinematics.compute(x[layout.joints], angular=turning, derivatives=True)
        arm = kinematics.position @ rotation.T
        linear = rotation @ kinematics.linear
        points = arm + translation
        n_c = len(points)
        d_points = np.empty((n_c, 3, layout.n_geometric))
        d_points[:, :, :n_q] = linear
        d_points[:, :, layout.translation] = np.eye(3)
        d_points[:, :, layout.rotation] = -skew(arm) @ turn

        surface = self.problem.grasp_object.sample(points)
        normals, d_normals, d_gaps = _normals(surface, d_points)

        # J = R v − r n × R ω; derivatives by q, by the palm's rotation, and through n.
        turns = skew(turn.T)[:, None]
        d_jacobian = np.zeros((layout.n_geometric, n_c, 3, n_q))
        np.matmul(rotation, kinematics.linear_derivative, out=d_jacobian[:n_q])
        np.matmul(turns, linear, out=d_jacobian[layout.rotation])
        if self._round:
            linear = linear + self._round_tips(kinematics, rotation, normals, d_normals, turns, d_jacobian)
            points = points + radii[:, None] * normals
            d_points = d_points + radii[:, None, None] * d_normals
        jacobian: Array = linear.reshape(3 * n_c, n_q)
        slope: Array = d_jacobian.reshape(layout.n_geometric, 3 * n_c, n_q)
        held = None
        if self._model is not None:
            held = HeldBasis.at(self._model, points, d_points, normals, d_normals)
            jacobian, slope = held.jacobian(*self._twists(kinematics, rotation, turns, jacobian, slope))
        return ContactGeometry(
            rotation=rotation,
            translation=translation,
            points=points,
            normals=normals,
            gaps=surface.distance - radii,
            grasp=_grasp_matrix(points) if held is None else held.grasp,
            jacobian=jacobian,
            d_points=d_points,
            d_normals=d_normals,
            d_gaps=d_gaps,
            d_jacobian=slope,
            covectors=normals if held is None else held.covectors,
            d_covectors=d_normals if held is None else held.d_covectors,
            held=held,
            turn=turn,
            placements=kinematics.placements,
            twists=kinematics.twists,
        )

    def _twists(
        self, kinematics: ContactKinematics, rotation: Array, turns: Array, linear: Array, d_linear: Array
    ) -> tuple[Array, Array]:
        """Return (v; ω) of the touching points by the joints and, variable first, their derivatives."""
        layout, angular = self.layout, rotation @ kinematics.angular
        shape = angular.shape
        d_angular = np.zeros((layout.n_geometric, *shape))
        np.matmul(rotation, kinematics.angular_derivative, out=d_angular[: layout.n_joints])
        np.matmul(turns, angular, out=d_angular[layout.rotation])
        twists = np.concatenate([linear.reshape(shape), angular], axis=1)
        return twists, np.concatenate([d_linear.reshape(-1, *shape), d_angular], axis=2)

    def _round_tips(
        self,
        kinematics: ContactKinematics,
        rotation: Array,
        normals: Array,
        d_normals: Array,
        turns: Array,
        d_jacobian: Array,
    ) -> Array:
        """Return −r n × R ω, the part of J due to fingertip radii, and add its derivatives to ``d_jacobian``."""
        layout, n_q = self.layout, self.layout.n_joints
        arms = skew(-self._radii[:, None] * normals)
        angular = rotation @ kinematics.angular
        d_jacobian[:n_q] += arms @ (rotation @ kinematics.angular_derivative)
        d_jacobian[layout.rotation] += arms @ (turns @ angular)
        d_jacobian += skew((-self._radii[:, None, None] * d_normals).transpose(2, 0, 1)) @ angular
        return arms @ angular


def _normals(surface: SurfaceSample, d_points: Array) -> tuple[Array, Array, Array]:
    """Return normals into the object, their derivatives (the object's curvature) and those of the distance."""
    gradient = surface.gradient
    slope = np.sqrt(np.einsum("ij,ij->i", gradient, gradient))[:, None]
    normals = -gradient / slope
    bend = surface.hessian / slope[:, :, None]
    bend = bend - normals[:, :, None] * (normals[:, None, :] @ bend)
    return normals, -bend @ d_points, (gradient[:, None, :] @ d_points)[:, 0]


def _grasp_matrix(points: Array) -> Array:
    """Return G = [I; skew(c_i)] without intermediate stacks."""
    grasp = np.empty((6, len(points), 3))
    grasp[:3] = np.eye(3)[:, None, :]
    grasp[3:] = skew(points).transpose(1, 0, 2)
    return grasp.reshape(6, -1)
