"""Meshes and finite differences shared by the tests of objects and hands."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

import grasp_planner as gp


def make_torus(folder: Path) -> Path:
    """A smooth torus in metres, as STL."""
    path = folder / "torus.stl"
    trimesh.creation.torus(0.035, 0.014, major_sections=64, minor_sections=32).export(path)
    return path


def make_mug(folder: Path) -> Path:
    """A mug with a handle in millimetres, as PLY: thin walls, sharp edges, a hole."""
    cylinder = trimesh.creation.cylinder
    cup = trimesh.boolean.difference(
        [
            cylinder(radius=35, height=80, sections=48),
            cylinder(radius=30, height=80, sections=48).apply_translation([0, 0, 6]),
        ]
    )
    handle = trimesh.creation.torus(22, 5, major_sections=48, minor_sections=16)
    handle.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    handle.apply_translation([38, 0, 0])
    handle = trimesh.boolean.difference([handle, cylinder(radius=32, height=100, sections=48)])
    path = folder / "mug.ply"
    trimesh.boolean.union([cup, handle]).export(path)
    return path


def make_bracket(folder: Path) -> Path:
    """An L of two boxes in metres, as OBJ: convex and concave sharp edges."""
    foot, wall = trimesh.creation.box((0.08, 0.05, 0.02)), trimesh.creation.box((0.02, 0.05, 0.08))
    wall.apply_translation([-0.03, 0, 0.03])
    path = folder / "bracket.obj"
    trimesh.boolean.union([foot, wall]).export(path)
    return path


def central_differences(function: Callable[[np.ndarray], np.ndarray], x: np.ndarray, step: float) -> np.ndarray:
    """Derivatives of a function by x, as last axis."""
    columns = []
    for k in range(x.size):
        shift = np.zeros_like(x)
        shift[k] = step
        columns.append((np.asarray(function(x + shift)) - np.asarray(function(x - shift))) / (2 * step))
    return np.stack(columns, axis=-1)


def surface_points(grasp_object: gp.GraspObject, count: int, seed: int = 0) -> np.ndarray:
    """Random points on the object's mesh."""
    return np.asarray(trimesh.sample.sample_surface(grasp_object.mesh, count, seed=seed)[0])
