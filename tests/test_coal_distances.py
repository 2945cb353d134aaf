"""Signed distances by coal, deep overlaps included."""

import coal
import numpy as np

from grasp_planner.collision.coal_distances import ExactDistance


def test_deep_overlaps_have_the_depth_of_the_support_functions():
    """A capsule within a cylinder, against the least overlap over many directions."""
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(40_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    checked = 0
    for _ in range(60):
        radius, height = rng.uniform(0.02, 0.045), 0.15
        rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        rotation *= np.sign(np.linalg.det(rotation))
        position = rng.uniform(-0.03, 0.03, 3)
        of_capsule = 0.01 + 0.02 * np.abs((directions @ rotation)[:, 2])
        of_cylinder = radius * np.linalg.norm(directions[:, :2], axis=1) + height / 2 * np.abs(directions[:, 2])
        depth = float((of_capsule + directions @ position + of_cylinder).min())
        if depth < 0.002:
            continue
        checked += 1
        found = ExactDistance()(
            coal.Capsule(0.01, 0.04),
            coal.Transform3s(rotation, position),
            coal.Cylinder(radius, height),
            coal.Transform3s.Identity(),
        )
        assert -1.03 * depth - 5e-4 < found < -0.9 * depth + 5e-4
    assert checked > 40
