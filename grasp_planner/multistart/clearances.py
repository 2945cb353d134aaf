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
from ..spatial import Array, Indices, namespace
from .contacts import BatchedContacts
from .filling import inner_pieces
from .rows import Rows, side_by_side
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
        long = (self._object_ends[0] != self._object_ends[1]).any(axis=1)
        self._object_points, self._object_lines = np.flatnonzero(~long), np.flatnonzero(long)
        self._object_order = np.argsort(np.concatenate([self._object_points, self._object_lines]))
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
        pieces_of = np.array([(a, b) for _, a, b in found], dtype=int).reshape(-1, 2)
        keys = [key for key, _, _ in found]
        firsts = [k for k in range(len(keys)) if k == 0 or keys[k] != keys[k - 1]]
        self._groups = np.array(firsts, dtype=int)
        long = (self._starts != self._ends).any(axis=1)[pieces_of].any(axis=1)
        # Evaluated are pairs of points first, then those with a line; the order takes these back to the groups.
        kinds = np.argsort(long, stable=True)
        self._pairs, self._pair_order, self._n_points = pieces_of[kinds], np.argsort(kinds), int((~long).sum())

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
        pulled = self._pulled(contacts, self._object_joints, points, normals)
        derivative = side_by_side([pulled, normals, cross(points, normals)], contacts.d_torques.shape[2])
        return Rows(name, distance - self._object_radii - self.options.margin, derivative)

    def _least(self, start: Array, along: Array) -> tuple[Array, Array, Array]:
        """Return the least φ on segments in O, of shape (B, k), where along them, and ∇φ there."""
        xp, points, lines = namespace(start), self._object_points, self._object_lines
        found = []
        if len(points):
            sample = self.problem.grasp_object.solid.sample(start[:, points].reshape(-1, 3))
            found.append((sample.distance, xp.zeros_like(sample.distance), sample.gradient))
        if len(lines):
            found.append(self._least_on_lines(start[:, lines].reshape(-1, 3), along[:, lines].reshape(-1, 3)))
        distance, t, gradient = (
            xp.concatenate([part.reshape(len(start), -1, *part.shape[1:]) for part in parts], axis=1)
            for parts in zip(*found, strict=True)
        )
        order = self._object_order
        return distance[:, order], t[:, order], gradient[:, order]

    def _least_on_lines(self, flat: Array, slope: Array) -> tuple[Array, Array, Array]:
        """Return the least φ on n segments that are no points, of shape (n,), where along them, and ∇φ there."""
        xp, solid, count = namespace(flat), self.problem.grasp_object.solid, len(flat)
        tries = xp.asarray(np.repeat(SAMPLES, count))
        found = solid.sample(xp.tile(flat, (len(SAMPLES), 1)) + tries[:, None] * xp.tile(slope, (len(SAMPLES), 1)))
        best = found.distance.reshape(len(SAMPLES), count).argmin(axis=0)
        rows = best * count + np.arange(count)
        t, sample = tries[rows], (found.distance[rows], found.gradient[rows], found.hessian[rows])
        for _ in range(NEWTON_STEPS):
            _, gradient, hessian = sample
            first = xp.einsum("ij,ij->i", gradient, slope)
            second = xp.einsum("ij,ijk,ik->i", slope, hessian, slope)
            floor = 1e-9 + 0.5 * xp.abs(first)  # a step of two where there is no curvature: to the end
            t = xp.clip(t - first / xp.maximum(second, floor), 0.0, 1.0)
            now = solid.sample(flat + t[:, None] * slope)
            sample = (now.distance, now.gradient, now.hessian)
        return sample[0], t, sample[1]

    def _self_rows(self, contacts: BatchedContacts) -> Rows:
        """Return the least distance of each two fingers and of each finger and the palm."""
        placed, count = contacts.placed, len(contacts.states)
        start = placed.points(self._joints, self._starts)
        xp, (first, second) = namespace(start), self._pairs.T
        a, b = (start[:, index[: self._n_points]] for index in (first, second))
        if self._n_points < len(first):
            end, lines = placed.points(self._joints, self._ends), (index[self._n_points :] for index in (first, second))
            ends = (array[:, index].reshape(-1, 3) for index in lines for array in (start, end))
            closest = (points.reshape(count, -1, 3) for points in segment_pairs(*ends))
            a, b = (xp.concatenate(parts, axis=1) for parts in zip((a, b), closest, strict=True))
        apart = a - b
        axis_distance = xp.sqrt(xp.einsum("bkl,bkl->bk", apart, apart)) + 1e-12
        distance = axis_distance - (self._radii[first] + self._radii[second])
        worst = self._worst(distance)
        rows = np.arange(count)[:, None]
        normals = apart[rows, worst] / axis_distance[rows, worst][..., None]
        sides = ((a, first, normals), (b, second, -normals))
        pulls = [self._pulled(contacts, xp.take(self._joints[k], worst), p[rows, worst], n) for p, k, n in sides]
        derivative = side_by_side([pulls[0] + pulls[1]], contacts.d_torques.shape[2])
        return Rows("self_collision", distance[rows, worst] - self.options.margin, derivative)

    def _worst(self, distance: Array) -> Indices:
        """Return which pair of every group is closest, of shape (B, groups)."""
        xp, grouped = namespace(distance), distance[:, self._pair_order]
        parts = pairwise([*self._groups.tolist(), distance.shape[1]])
        least = xp.stack([low + grouped[:, low:high].argmin(axis=1) for low, high in parts], axis=1)
        return xp.take(self._pair_order, least)

    def _ground_rows(self, contacts: BatchedContacts) -> Rows:
        """Return the least height of any point above the ground."""
        states, count = contacts.states, len(contacts.states)
        up = (states.rotation.transpose(0, 2, 1) @ self.problem.up)[:, None]
        points = contacts.placed.points(self._corner_joints, self._corners)
        heights = ((points - contacts.origin[:, None]) * up).sum(axis=2) - self._rims - float(self.options.ground or 0)
        worst = heights.argmin(axis=1)[:, None]
        rows = np.arange(count)[:, None]
        lowest = points[rows, worst]
        pulled = self._pulled(contacts, namespace(worst).take(self._corner_joints, worst), lowest, up)
        derivative = side_by_side([pulled, up, cross(lowest, up)], contacts.d_torques.shape[2])
        return Rows("ground", heights[rows, worst], derivative)

    def _leaning_rows(
        self, name: str, axes: tuple[tuple[int, int, Array, float], ...], contacts: BatchedContacts
    ) -> Rows:
        """Return n·a + b of touching links: their normals into the object against their axes."""
        which, joints = (np.array([each[k] for each in axes], dtype=int) for k in (0, 1))
        along = contacts.placed.directions(joints, np.array([each[2] for each in axes]))
        room = np.array([each[3] for each in axes])
        xp, normals, n_q = namespace(along), contacts.normals[:, which], self.problem.hand.n_joints
        leant = (contacts.d_normals[:, which] @ along[..., None])[..., 0]
        spins = (contacts.placed.axes @ cross(along, normals).transpose(0, 2, 1)).transpose(0, 2, 1)
        turning = spins * (self.tree.carried[joints] * ~self.tree.slides)
        by_joints = leant[:, :, :n_q] + turning @ self.problem.hand.coupling
        derivative = side_by_side([by_joints, leant[:, :, n_q:]], contacts.d_torques.shape[2])
        value = xp.einsum("bik,bik->bi", normals, along) + room
        return Rows(name, value, derivative, equality=name == "tangency")

    def _pulled(self, contacts: BatchedContacts, joints: Indices, points: Array, normals: Array) -> Array:
        """Return ∂(n·p) by the joint angles of points fixed to joints, of shape (B, k, n_q)."""
        xp, placed = namespace(points), contacts.placed
        moments = cross(placed.translations[:, self.tree.joint_of], placed.axes)
        turning = xp.where(self.tree.slides[:, None], 0.0, placed.axes)
        shifting = xp.where(self.tree.slides[:, None], placed.axes, moments)
        every = cross(points, normals) @ turning.transpose(0, 2, 1) + normals @ shifting.transpose(0, 2, 1)
        return (every * xp.take(self.tree.carried, joints, axis=0)) @ self.problem.hand.coupling
