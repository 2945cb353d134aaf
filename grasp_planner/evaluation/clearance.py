"""Clearances of the hand as smooth functions of the variables: object, other fingers, ground; with derivatives.

Spheres and capsules against the object use its signed distance along their axis, and against each other the
distance of their axes: both stay smooth when bodies overlap. Other shapes use coal. Derivatives are those of the
witness points, held fixed on their links, along the normal between them (envelope theorem).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..collision.coal_distances import CoalPairs
from ..collision.distances import SegmentSearch, grouped_minimum, saturate
from ..collision.link_shapes import (
    LinkShape,
    guarded_shapes,
    inner_axes,
    joint_centres,
    link_shapes,
    shape_pairs,
    tip_axes,
)
from ..hand.hull_fit import hull_of
from ..problem.problem import GraspProblem
from ..spatial import Array, Indices, cross_rows
from .contact_geometry import ContactGeometry
from .segments import PosedJoints, Segments
from .variables import VariableLayout

ACTIVATION = 0.02
"""Clearances saturate smoothly at this value [m]: what is 1.5 times as far costs nothing and pulls nothing."""
TEMPERATURE = 2e-4
"""Sharpness T of the smooth minimum over the pairs of two fingers [m]."""
NEGLIGIBLE = 1e-15
"""Weight of a pair in that minimum below which its derivatives are left out: far below rounding."""


@dataclass(frozen=True)
class ClearanceState:
    """Clearances at one x [m], with derivatives by the n_g = n_q + 6 variables (q, w); empty where not asked for.

    Attributes:
        link_object: Saturated signed distances of links from the object, of shape (m_o,).
        d_link_object: Derivatives, of shape (m_o, n_g).
        self_collision: Smooth least distances of each two fingers and of each finger and the palm, of shape (m_s,).
        d_self_collision: Derivatives, of shape (m_s, n_g).
        ground: Smooth least heights above the ground of the palm and of each finger, of shape (m_g,).
        d_ground: Derivatives, of shape (m_g, n_g).
        tip_patch: n·a + b of each touching link, of shape (m_t,).
        d_tip_patch: Derivatives, of shape (m_t, n_g).
        tangency: n·a of each inner link that touches with its side, of shape (m_i,).
        d_tangency: Derivatives, of shape (m_i, n_g).
    """

    link_object: Array
    d_link_object: Array
    self_collision: Array
    d_self_collision: Array
    ground: Array
    d_ground: Array
    tip_patch: Array
    d_tip_patch: Array
    tangency: Array
    d_tangency: Array


class ClearanceEvaluator:
    """Evaluates the clearances of a problem; remembers where searches ended, for one thread."""

    def __init__(self, problem: GraspProblem) -> None:
        self.problem, self.options = problem, problem.clearance
        hand = problem.hand
        self.layout = VariableLayout.of(problem)
        self._masks = np.zeros((hand.model.njoints, hand.model.nv))
        for joint, support in enumerate(hand.model.supports):
            self._masks[joint, [hand.model.joints[k].idx_v for k in support.tolist()[1:]]] = 1.0
        shapes = link_shapes(hand)
        self._segments = Segments(shapes)
        self._set_object(shapes)
        self._set_self(shapes)
        self._set_ground(shapes)
        tips = tip_axes(hand, problem.frames) if self.options.tip_patch else ()
        sides = inner_axes(hand, shapes, problem.frames) if self.options.link_object == "geometry" else ()
        self._n_tips, touching = len(tips), (*(tip[:3] for tip in tips), *sides)
        self._room = np.array([*(tip[3] for tip in tips), *(0.0 for _ in sides)])
        self._touching = np.array([touch[0] for touch in touching], dtype=int)
        self._touching_joints = np.array([touch[1] for touch in touching], dtype=int)
        self._touching_axes = np.array([touch[2] for touch in touching]).reshape(-1, 3, 1)

    def serves(self, problem: GraspProblem) -> bool:
        """Return whether another problem has the same clearances: the same hand, object and options, no ground."""
        mine = self.problem
        same = problem.hand is mine.hand and problem.grasp_object is mine.grasp_object
        return (
            same and self.options.ground is None and (problem.clearance, problem.frames) == (self.options, mine.frames)
        )

    def evaluate(self, geometry: ContactGeometry) -> ClearanceState:
        """Evaluate all clearances.

        Args:
            geometry: The contact geometry at the point.

        Returns:
            Clearances with derivatives.
        """
        pose, turn = PosedJoints(self.problem.hand, geometry), geometry.turn
        ends = self._segments.place(pose)
        link_object = self._link_object(pose, turn, ends)
        self_collision = self._self_collision(pose, ends)
        ground = self._ground(pose, turn)
        leaning, d_leaning = self._leaning(pose, turn, geometry)
        tip_patch, tangency = (
            (leaning[rows], d_leaning[rows]) for rows in (slice(self._n_tips), slice(self._n_tips, None))
        )
        return ClearanceState(*link_object, *self_collision, *ground, *tip_patch, *tangency)

    # --- what is evaluated ---------------------------------------------------------------------------

    def _set_object(self, shapes: tuple[LinkShape, ...]) -> None:
        """Choose the solids that keep clear of the object."""
        hand, grasp_object = self.problem.hand, self.problem.grasp_object.solid
        guarded: tuple[LinkShape, ...] = ()
        if self.options.link_object == "geometry":
            guarded = guarded_shapes(hand, shapes, self.problem.frames, self.options.margin, convex=grasp_object.convex)
        elif self.options.link_object == "joint_centres":
            guarded = joint_centres(hand)
        swept = [shape for shape in guarded if shape.geometry is None]
        self._swept = Segments(swept)
        self._swept_rows = None  # where the swept shapes are among all of them, if they are
        if self.options.link_object == "geometry" and all(shape in shapes for shape in swept):
            self._swept_rows = np.array([shapes.index(shape) for shape in swept], dtype=int)
        self._search = SegmentSearch(grasp_object, len(self._swept.radii))
        solids = [shape for shape in guarded if shape.geometry is not None]
        self._solids = CoalPairs.with_object(solids, grasp_object) if solids else None

    def _set_self(self, shapes: tuple[LinkShape, ...]) -> None:
        """Choose the pairs of solids that keep clear of each other, and their groups.

        What a mesh stands out of its hull may take up half of the margin: two meshes stay apart all the same.
        """
        pairs = shape_pairs(self.problem.hand, shapes) if self.options.self_collision else ()
        keys = [tuple(sorted((shapes[i].branch, shapes[j].branch))) for i, j in pairs]
        groups = {key: row for row, key in enumerate(sorted(set(keys)))}
        self._n_groups = len(groups)
        swept = [k for k, (i, j) in enumerate(pairs) if shapes[i].geometry is None and shapes[j].geometry is None]
        solid = sorted(set(range(len(pairs))) - set(swept))
        self._pair_groups = np.array([groups[keys[k]] for k in (*swept, *solid)], dtype=int)
        order = np.array([pairs[k] for k in (*swept, *solid)], dtype=int).reshape(-1, 2)
        self._pairs, joints = order[: len(swept)], self._segments.joints[order]
        self._pair_masks = self._masks[joints[:, 1]] - self._masks[joints[:, 0]]
        self._solid_pairs = None
        if solid:
            thin = [_thinned(shape, 0.5 * self.options.margin) for shape in shapes]
            self._solid_pairs = CoalPairs([(thin[pairs[k][0]], thin[pairs[k][1]]) for k in solid])

    def _set_ground(self, shapes: tuple[LinkShape, ...]) -> None:
        """Choose the points that stay above the ground."""
        used = shapes if self.options.ground is not None else ()
        branches = {branch: row for row, branch in enumerate(sorted({shape.branch for shape in used}))}
        self._corner_joints = np.array([shape.joint for shape in used for _ in shape.corners], dtype=int)
        self._corners = np.array([corner for shape in used for corner in shape.corners]).reshape(-1, 3)
        self._rims = np.array([shape.rim for shape in used for _ in shape.corners])
        self._corner_groups = np.array([branches[shape.branch] for shape in used for _ in shape.corners], dtype=int)
        self._n_branches = len(branches)

    # --- evaluation ----------------------------------------------------------------------------------

    def _link_object(self, pose: PosedJoints, turn: Array, ends: Array) -> tuple[Array, Array]:
        """Return the clearances from the object and their derivatives."""
        limit = ACTIVATION + self.options.margin
        swept = self._swept
        distance: Array = np.zeros(0)
        points: Array = np.zeros((0, 3))
        normals: Array = np.zeros((0, 3))
        joints = swept.joints
        if joints.size:
            placed = swept.place(pose) if self._swept_rows is None else ends[:, self._swept_rows]
            start, end = pose.in_object(placed)
            distance, points, normals = self._search.least(start, end, 1.5 * limit + swept.radii)
            distance = distance - swept.radii
        if self._solids is not None:
            by_coal = self._solids.distances(pose, 1.5 * limit, in_object=True)
            distance = np.concatenate([distance, by_coal.distance])
            points = np.vstack([points, by_coal.points_a])
            normals = np.vstack([normals, -by_coal.normals])
            joints = np.concatenate([joints, by_coal.joints_a])
        value, slope = saturate(distance, limit)
        return value, slope[:, None] * self._pulled(pose, turn, joints, points, normals)

    def _self_collision(self, pose: PosedJoints, ends: Array) -> tuple[Array, Array]:
        """Return the least distances of each two fingers and their derivatives.

        Both witness points lie on one line along the normal, so that one lever serves both links of a pair: what
        moves the pair apart are the joints that carry one of them and not the other.
        """
        gradient = np.zeros((self._n_groups, self.layout.n_geometric))
        if self._n_groups == 0:
            return np.zeros(0), gradient
        limit = ACTIVATION + self.options.margin
        near, distance, normals, points = self._segments.near(ends, self._pairs, 1.5 * limit)
        if self._solid_pairs is not None:
            found = self._solid_pairs.distances(pose, 1.5 * limit)
            close = np.flatnonzero(found.distance < 1.5 * limit)
            near = np.concatenate([near, len(self._pairs) + close])
            distance = np.concatenate([distance, found.distance[close]])
            normals, points = np.vstack([normals, found.normals[close]]), np.vstack([points, found.points_a[close]])
        values = np.full(self._pair_groups.size, limit)
        values[near], slope = saturate(distance, limit)
        least, weights = grouped_minimum(values, self._pair_groups, self._n_groups, TEMPERATURE)
        weight = weights[near] * slope
        counts = np.flatnonzero(weight > NEGLIGIBLE)
        near, weight, normals = near[counts], weight[counts], normals[counts]
        twist = normals @ pose.linear + cross_rows(points[counts], normals) @ pose.angular
        spread = np.zeros((self._n_groups, len(near)))
        spread[self._pair_groups[near], np.arange(len(near))] = weight
        gradient[:, self.layout.joints] = spread @ (twist * self._pair_masks[near]) @ self.problem.hand.coupling
        return least, gradient

    def _ground(self, pose: PosedJoints, turn: Array) -> tuple[Array, Array]:
        """Return the least heights above the ground and their derivatives."""
        if self._n_branches == 0:
            return np.zeros(0), np.zeros((0, self.layout.n_geometric))
        up = self.problem.up
        points = pose.in_object(pose.place(self._corner_joints, self._corners))
        heights = points @ up - self._rims - float(self.options.ground or 0.0)
        rows = self._pulled(pose, turn, self._corner_joints, points, np.tile(up, (len(points), 1)))
        least, weights = grouped_minimum(heights, self._corner_groups, self._n_branches, TEMPERATURE)
        gradient = np.zeros((self._n_branches, self.layout.n_geometric))
        np.add.at(gradient, self._corner_groups, weights[:, None] * rows)
        return least, gradient

    def _leaning(self, pose: PosedJoints, turn: Array, geometry: ContactGeometry) -> tuple[Array, Array]:
        """Return n·a + b of each touching link and its derivatives; dn from the object's curvature, da = ω × a."""
        if self._touching.size == 0:
            return np.zeros(0), np.zeros((0, self.layout.n_geometric))
        joints = self._touching_joints
        axes = (pose.rotations[joints] @ self._touching_axes)[:, :, 0] @ pose.root_rotation.T
        normals = geometry.normals[self._touching]
        gradient = (axes[:, None, :] @ geometry.d_normals[self._touching])[:, 0]
        levers = cross_rows(axes, normals)
        spin = ((levers @ pose.root_rotation) @ pose.angular) * self._masks[joints]
        gradient[:, self.layout.joints] += spin @ self.problem.hand.coupling
        gradient[:, self.layout.rotation] += levers @ turn
        return np.einsum("ij,ij->i", normals, axes) + self._room, gradient

    def _pulled(self, pose: PosedJoints, turn: Array, joints: Indices, points: Array, normals: Array) -> Array:
        """Return ∂(n·p)/∂(q, w) of points fixed on links, p and n in O, of shape (m, n_g)."""
        rows = np.empty((len(joints), self.layout.n_geometric))
        in_root = (points - pose.root_translation) @ pose.root_rotation
        moved = self._moved(pose, joints, in_root, normals @ pose.root_rotation)
        rows[:, self.layout.joints] = moved @ self.problem.hand.coupling
        rows[:, self.layout.translation] = normals
        rows[:, self.layout.rotation] = cross_rows(points - pose.palm, normals) @ turn
        return rows

    def _moved(self, pose: PosedJoints, joints: Indices, points: Array, normals: Array) -> Array:
        """Return ∂(n·p)/∂(all joint angles) of points fixed on links, all in the root frame, of shape (m, nv)."""
        return (normals @ pose.linear + cross_rows(points, normals) @ pose.angular) * self._masks[joints]


def _thinned(shape: LinkShape, most: float) -> LinkShape:
    """Return a hull around a mesh with so much less of its rim at most [m]; other solids as they are."""
    if not shape.fitted or shape.geometry is None:
        return shape
    rim, back = max(0.0, shape.rim - most), shape.placement.inverse()
    hull = hull_of(np.array([back.act(corner) for corner in shape.corners]), rim)
    return replace(shape, rim=rim, geometry=hull.geometry())
