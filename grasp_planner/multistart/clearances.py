"""Clearances for a batch of states: links against the object, against each other, above the ground; leaning contacts.

Spheres and capsules are exact; boxes, cylinders and meshes are filled with spheres here, inside of them, so that what
this search finds is brought clear by the exact distances of :mod:`grasp_planner.evaluation.clearance` afterwards.
Derivatives are those of witness points held fixed on their links (envelope theorem).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..collision.distances import segment_pairs
from ..collision.link_shapes import (
    LinkShape,
    contact_shapes,
    guarded_shapes,
    inner_axes,
    joint_centres,
    link_shapes,
    shape_pairs,
    tip_axes,
)
from ..problem.problem import GraspProblem
from ..spatial import Array, Indices
from .contacts import BatchedContacts
from .filling import inner_pieces
from .rows import Rows
from .tree import BatchedTree, cross

SAMPLES = (0.05, 0.5, 0.95)
"""Where along a segment the search for its least distance begins."""
NEWTON_STEPS = 2


class BatchedClearances:
    """Evaluates what the clearance options of a problem ask for."""

    def __init__(self, problem: GraspProblem, tree: BatchedTree) -> None:
        self.problem, self.tree, self.options = problem, tree, problem.clearance
        shapes = link_shapes(problem.hand)
        pieces, guarded = inner_pieces(shapes), self._guarded(shapes)
        self._joints = np.array([each.joint for each in pieces], dtype=int)
        self._starts = np.array([each.start for each in pieces]).reshape(-1, 3)
        self._ends = np.array([each.end for each in pieces]).reshape(-1, 3)
        self._radii = np.array([each.radius for each in pieces])
        self._near_object = np.array([each.name in guarded for each in pieces], dtype=bool)
        self._object_joints = self._joints[self._near_object]
        self._object_ends = (self._starts[self._near_object], self._ends[self._near_object])
        self._object_radii = self._radii[self._near_object]
        if self.options.link_object == "joint_centres":
            points = joint_centres(problem.hand)
            self._object_joints = np.array([each.joint for each in points], dtype=int)
            self._object_ends = (np.zeros((len(points), 3)), np.zeros((len(points), 3)))
            self._object_radii = np.zeros(len(points))
        self._object_lines = (self._object_ends[0] != self._object_ends[1]).any(axis=1)
        self._set_pairs(shapes)
        self._set_ground(shapes)
        tips = tip_axes(problem.hand, problem.frames) if self.options.tip_patch else ()
        sides = inner_axes(problem.hand, shapes, problem.frames) if self.options.link_object == "geometry" else ()
        self._leaning = {"tip_patch": tips, "tangency": tuple((*side, 0.0) for side in sides)}

    def rows(self, contacts: BatchedContacts) -> list[Rows]:
        """Return the rows of all clearances at the contacts of a batch of states."""
        found = []
        if self.options.link_object != "off" and len(self._object_joints):
            name = "link_object" if self.options.link_object == "geometry" else "joint_centre"
            found.append(self._object_rows(name, contacts))
        if self.options.self_collision and len(self._groups):
            found.append(self._self_rows(contacts))
        if self.options.ground is not None:
            found.append(self._ground_rows(contacts))
        found += [self._leaning_rows(name, axes, contacts) for name, axes in self._leaning.items() if axes]
        return found

    def _guarded(self, shapes: tuple[LinkShape, ...]) -> frozenset[str]:
        """Return the names of the solids that keep clear of the object."""
        if self.options.link_object != "geometry":
            return frozenset()
        convex, frames = self.problem.grasp_object.solid.convex, self.problem.frames
        kept = guarded_shapes(self.problem.hand, shapes, frames, self.options.margin, convex=convex)
        touching = contact_shapes(self.problem.hand, shapes, frames)
        return frozenset(shape.name for shape in kept if shape.name not in touching)

    def _set_pairs(self, shapes: tuple[LinkShape, ...]) -> None:
        """Choose the pairs of filled solids that keep clear of each other, sorted by the groups they count in."""
        bodies = inner_pieces(shapes)
        pieces: dict[str, list[int]] = {}
        for index, each in enumerate(bodies):
            pieces.setdefault(each.name, []).append(index)
        pairs = shape_pairs(self.problem.hand, shapes) if self.options.self_collision else ()
        found = sorted(
            (tuple(sorted((shapes[i].branch, shapes[j].branch))), a, b)
            for i, j in pairs
            for a in pieces[shapes[i].name]
            for b in pieces[shapes[j].name]
        )
        self._pairs = np.array([(a, b) for _, a, b in found], dtype=int).reshape(-1, 2)
        keys = [key for key, _, _ in found]
        firsts = [k for k in range(len(keys)) if k == 0 or keys[k] != keys[k - 1]]
        self._groups = np.array(firsts, dtype=int)
        long = (self._starts != self._ends).any(axis=1)
        self._lines = np.flatnonzero(long[self._pairs].any(axis=1))

    def _set_ground(self, shapes: tuple[LinkShape, ...]) -> None:
        """Choose the points that stay above the ground."""
        used = shapes if self.options.ground is not None else ()
        self._corner_joints = np.array([shape.joint for shape in used for _ in shape.corners], dtype=int)
        self._corners = np.array([corner for shape in used for corner in shape.corners]).reshape(-1, 3)
        self._rims = np.array([shape.rim for shape in used for _ in shape.corners])

    def _object_rows(self, name: str, contacts: BatchedContacts) -> Rows:
        """Return the distances of links from the object."""
        placed, states = contacts.placed, contacts.states
        start, end = (placed.points(self._object_joints, ends) for ends in self._object_ends)
        turned = states.rotation[:, None]
        a, along = (turned @ start[..., None])[..., 0] + states.translation[:, None], turned @ (end - start)[..., None]
        distance, t, normal = self._least(a, along[..., 0])
        points = start + t[..., None] * (end - start)
        normals = (turned.transpose(0, 1, 3, 2) @ normal[..., None])[..., 0]
        derivative = self._pulled(contacts, self._object_joints, points, normals)
        n_q = self.problem.hand.n_joints
        derivative[:, :, n_q : n_q + 3] = normals
        derivative[:, :, n_q + 3 : n_q + 6] = cross(points, normals)
        return Rows(name, distance - self._object_radii - self.options.margin, derivative)

    def _least(self, start: Array, along: Array) -> tuple[Array, Array, Array]:
        """Return the least φ on segments in O, of shape (B, k), where along them, and ∇φ there."""
        shape, solid = start.shape[:2], self.problem.grasp_object.solid
        lines = np.flatnonzero(self._object_lines)
        points = np.flatnonzero(~self._object_lines)
        distance, t, gradient = np.empty(shape), np.zeros(shape), np.empty((*shape, 3))
        if len(points):
            found = solid.sample(start[:, points].reshape(-1, 3))
            distance[:, points] = found.distance.reshape(-1, len(points))
            gradient[:, points] = found.gradient.reshape(-1, len(points), 3)
        if len(lines):
            parts = self._least_on_lines(start[:, lines].reshape(-1, 3), along[:, lines].reshape(-1, 3))
            for whole, part in zip((distance, t, gradient), parts, strict=True):
                whole[:, lines] = part.reshape(whole[:, lines].shape)
        return distance, t, gradient

    def _least_on_lines(self, flat: Array, slope: Array) -> tuple[Array, Array, Array]:
        """Return the least φ on n segments that are no points, of shape (n,), where along them, and ∇φ there."""
        solid, count = self.problem.grasp_object.solid, len(flat)
        tries = np.repeat(SAMPLES, count)
        found = solid.sample(np.tile(flat, (len(SAMPLES), 1)) + tries[:, None] * np.tile(slope, (len(SAMPLES), 1)))
        best = found.distance.reshape(len(SAMPLES), count).argmin(axis=0)
        rows = best * count + np.arange(count)
        t, sample = tries[rows], (found.distance[rows], found.gradient[rows], found.hessian[rows])
        for _ in range(NEWTON_STEPS):
            _, gradient, hessian = sample
            first = np.einsum("ij,ij->i", gradient, slope)
            second = np.einsum("ij,ijk,ik->i", slope, hessian, slope)
            floor = 1e-9 + 0.5 * np.abs(first)  # a step of two where there is no curvature: to the end
            t = np.clip(t - first / np.maximum(second, floor), 0.0, 1.0)
            now = solid.sample(flat + t[:, None] * slope)
            sample = (now.distance, now.gradient, now.hessian)
        return sample[0], t, sample[1]

    def _self_rows(self, contacts: BatchedContacts) -> Rows:
        """Return the least distance of each two fingers and of each finger and the palm."""
        placed, count = contacts.placed, len(contacts.states)
        start = placed.points(self._joints, self._starts)
        first, second = self._pairs.T
        a, b = start[:, first], start[:, second]
        if len(self._lines):
            end, lines = placed.points(self._joints, self._ends), self._lines
            ends = (array[:, index[lines]].reshape(-1, 3) for index in (first, second) for array in (start, end))
            a[:, lines], b[:, lines] = (points.reshape(count, -1, 3) for points in segment_pairs(*ends))
        apart = a - b
        axis_distance = np.sqrt(np.einsum("bkl,bkl->bk", apart, apart)) + 1e-12
        distance = axis_distance - (self._radii[first] + self._radii[second])
        worst = self._worst(distance)
        rows = np.arange(count)[:, None]
        normals = apart[rows, worst] / axis_distance[rows, worst][..., None]
        derivative = np.zeros((count, worst.shape[1], contacts.d_torques.shape[2]))
        for sign, points, index in ((1.0, a, first), (-1.0, b, second)):
            joints = self._joints[index][worst]
            derivative += self._pulled(contacts, joints, points[rows, worst], sign * normals)
        return Rows("self_collision", distance[rows, worst] - self.options.margin, derivative)

    def _worst(self, distance: Array) -> Indices:
        """Return which pair of every group is closest, of shape (B, groups)."""
        parts = pairwise([*self._groups.tolist(), distance.shape[1]])
        return np.stack([low + distance[:, low:high].argmin(axis=1) for low, high in parts], axis=1)

    def _ground_rows(self, contacts: BatchedContacts) -> Rows:
        """Return the least height of any point above the ground."""
        states, count = contacts.states, len(contacts.states)
        up = (states.rotation.transpose(0, 2, 1) @ self.problem.up)[:, None]
        points = contacts.placed.points(self._corner_joints, self._corners)
        heights = ((points - contacts.origin[:, None]) * up).sum(axis=2) - self._rims - float(self.options.ground or 0)
        worst = heights.argmin(axis=1)[:, None]
        rows = np.arange(count)[:, None]
        lowest = points[rows, worst]
        derivative = self._pulled(contacts, self._corner_joints[worst], lowest, up)
        n_q = self.problem.hand.n_joints
        derivative[:, :, n_q : n_q + 3] = up
        derivative[:, :, n_q + 3 : n_q + 6] = cross(lowest, up)
        return Rows("ground", heights[rows, worst], derivative)

    def _leaning_rows(
        self, name: str, axes: tuple[tuple[int, int, Array, float], ...], contacts: BatchedContacts
    ) -> Rows:
        """Return n·a + b of touching links: their normals into the object against their axes."""
        which, joints = (np.array([each[k] for each in axes], dtype=int) for k in (0, 1))
        along = contacts.placed.directions(joints, np.array([each[2] for each in axes]))
        room = np.array([each[3] for each in axes])
        normals, n_g = contacts.normals[:, which], contacts.d_normals.shape[2]
        derivative = np.zeros((len(normals), len(which), contacts.d_torques.shape[2]))
        derivative[:, :, :n_g] = (contacts.d_normals[:, which] @ along[..., None])[..., 0]
        spins = (contacts.placed.axes @ cross(along, normals).transpose(0, 2, 1)).transpose(0, 2, 1)
        turning = spins * (self.tree.carried[joints] * ~self.tree.slides)
        derivative[:, :, : self.problem.hand.n_joints] += turning @ self.problem.hand.coupling
        value = np.einsum("bik,bik->bi", normals, along) + room
        return Rows(name, value, derivative, equality=name == "tangency")

    def _pulled(self, contacts: BatchedContacts, joints: Indices, points: Array, normals: Array) -> Array:
        """Return ∂(n·p) by the joint angles of points fixed to joints, in columns of x, of shape (B, k, n_x)."""
        placed, n_q = contacts.placed, self.problem.hand.n_joints
        moments = cross(placed.translations[:, self.tree.joint_of], placed.axes)
        turning = np.where(self.tree.slides[:, None], 0.0, placed.axes)
        shifting = np.where(self.tree.slides[:, None], placed.axes, moments)
        every = cross(points, normals) @ turning.transpose(0, 2, 1) + normals @ shifting.transpose(0, 2, 1)
        derivative = np.zeros((*points.shape[:2], contacts.d_torques.shape[2]))
        derivative[:, :, :n_q] = (every * self.tree.carried[joints]) @ self.problem.hand.coupling
        return derivative
