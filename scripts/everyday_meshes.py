"""Everyday objects as meshes, made of revolved, swept and united parts; lengths in metres."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
from trimesh import creation

Mesh = trimesh.Trimesh


def _revolved(*points: tuple[float, float], sections: int = 64) -> Mesh:
    """Return a profile of (radius, height) in millimetres turned around z."""
    mesh = creation.revolve(np.array(points) / 1000, sections=sections)
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


def _at(mesh: Mesh, x: float, y: float, z: float, turn: str = "", degrees: float = 90.0) -> Mesh:
    """Return a mesh turned about an axis and moved by millimetres."""
    if turn:
        axis = [float(turn == letter) for letter in "xyz"]
        mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(degrees), axis))
    return mesh.apply_translation(np.array([x, y, z]) / 1000)


def _box(x: float, y: float, z: float) -> Mesh:
    """Return a box of millimetres."""
    return creation.box(np.array([x, y, z]) / 1000)


def _rod(radius: float, length: float) -> Mesh:
    """Return a cylinder of millimetres."""
    return creation.cylinder(radius=radius / 1000, height=length / 1000, sections=48)


def _united(*parts: Mesh) -> Mesh:
    """Return a union."""
    return trimesh.boolean.union(list(parts))


def _ball(shape: Callable[[np.ndarray], np.ndarray]) -> Mesh:
    """Return a ball of radius 1 mm whose directions are mapped to millimetres."""
    ball = creation.icosphere(subdivisions=4)
    return Mesh(shape(np.array(ball.vertices)) / 1000, ball.faces)


def _prism(outline: np.ndarray, height: float) -> Mesh:
    """Return an outline in millimetres, extruded."""
    from shapely.geometry import Polygon

    return creation.extrude_polygon(Polygon(outline / 1000), height / 1000)


def _swept(radius: Callable[[np.ndarray], np.ndarray], middle: np.ndarray, sections: int = 24) -> Mesh:
    """Return a tube of a radius, as function of 0 … 1, along a line in the plane of x and z; millimetres."""
    share = np.linspace(0.0, 1.0, len(middle))
    along = np.gradient(middle, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    side = np.array([0.0, 1.0, 0.0])
    other = np.cross(along, side)
    angle = np.linspace(0.0, 2 * np.pi, sections, endpoint=False)
    rings = np.cos(angle)[None, :, None] * side + np.sin(angle)[None, :, None] * other[:, None]
    points = (middle[:, None] + radius(share)[:, None, None] * rings).reshape(-1, 3)
    k, count = np.arange(sections), len(middle)
    after = (k + 1) % sections
    faces = []
    for ring in range(count - 1):
        low, high = ring * sections, (ring + 1) * sections
        faces += [np.column_stack([low + k, low + after, high + k])]
        faces += [np.column_stack([low + after, high + after, high + k])]
    last = (count - 1) * sections
    faces += [np.column_stack([np.full(sections, len(points)), after, k])]
    faces += [np.column_stack([np.full(sections, len(points) + 1), last + k, last + after])]
    mesh = Mesh(np.vstack([points, middle[[0, -1]]]) / 1000, np.vstack(faces))
    mesh.fix_normals()
    return mesh


def _arc(radius: float, start: float, end: float, count: int = 40) -> np.ndarray:
    """Return points of an arc in the plane of x and z [mm]."""
    angle = np.radians(np.linspace(start, end, count))
    return radius * np.column_stack([np.cos(angle), np.zeros(count), np.sin(angle)])


def _mug() -> Mesh:
    cup = _revolved((0, 0), (38, 0), (40, 2), (40, 93), (38.5, 95), (36, 93), (36, 5), (0, 5))
    handle = creation.torus(0.026, 0.006, major_sections=48, minor_sections=24)
    handle = trimesh.boolean.difference([_at(handle, 44, 0, 48, "x"), _at(_rod(38, 200), 0, 0, 50)])
    return _united(cup, handle)


def _star() -> Mesh:
    angle = np.linspace(0.0, 2 * np.pi, 200, endpoint=False)
    radius = 30.0 + 4.0 * np.cos(6 * angle)
    return _prism(radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]), 35.0)


def _hexagon(radius: float) -> np.ndarray:
    angle = np.radians(np.arange(0, 360, 60))
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _nut() -> Mesh:
    return trimesh.boolean.difference([_prism(_hexagon(32.0), 28.0), _at(_rod(17, 100), 0, 0, 14)])


def _glass() -> Mesh:
    outer = [(0, 0), (34, 0), (34, 3), (6, 8), (5, 80), (30, 105), (33, 130), (28, 160)]
    return _revolved(*outer, (26, 160), (30, 130), (0, 98))


def _spray() -> Mesh:
    body = _revolved((0, 0), (33, 0), (35, 3), (35, 110), (16, 145), (16, 175), (0, 175))
    return _united(body, _at(_box(85, 26, 28), 18, 0, 182))


def _lid() -> Mesh:
    return _revolved((0, 0), (70, 0), (72, 4), (40, 14), (12, 18), (12, 26), (20, 34), (18, 46), (0, 48))


def _bowl() -> Mesh:
    return _revolved((0, 0), (30, 0), (55, 22), (65, 48), (63.5, 50), (61, 48), (51, 25), (28, 5), (0, 5))


def _pyramid() -> Mesh:
    base = [[-35, -35, 0], [35, -35, 0], [35, 35, 0], [-35, 35, 0]]
    return trimesh.convex.convex_hull(np.array([*base, [0, 0, 75]]) / 1000)


def _drill() -> Mesh:
    return _united(
        _at(_rod(28, 130), 0, 0, 0, "y"), _at(_rod(19, 110), -25, 0, -60), _at(_box(75, 55, 35), -25, 0, -125)
    )


EVERYDAY: dict[str, tuple[float, Callable[[], Mesh]]] = {
    "can": (0.35, lambda: _revolved((0, 0), (28, 0), (33, 5), (33, 108), (27, 115), (0, 115))),
    "bottle": (0.5, lambda: _revolved((0, 0), (30, 0), (33, 4), (33, 120), (14, 165), (14, 200), (0, 200))),
    "mug": (0.3, _mug),
    "bowl": (0.25, _bowl),
    "carton": (0.3, lambda: _box(60, 60, 110)),
    "book": (0.4, lambda: _box(110, 150, 28)),
    "banana": (0.15, lambda: _swept(lambda s: 4 + 14 * np.sin(np.pi * s) ** 0.5, _arc(90.0, 30.0, 150.0))),
    "drill": (0.9, _drill),
    "bulb": (0.08, lambda: _revolved((0, 0), (13, 1), (13, 28), (20, 45), (30, 70), (28, 88), (16, 103), (0, 107))),
    "screwdriver": (0.12, lambda: _united(_at(_rod(15, 100), 0, 0, 50), _at(_rod(3, 110), 0, 0, 150))),
    "dish": (0.3, lambda: _revolved((0, 0), (45, 0), (80, 14), (79, 18), (43, 5), (0, 5))),
    "ring": (0.15, lambda: creation.torus(0.04, 0.009, major_sections=64, minor_sections=32)),
    "hammer": (0.45, lambda: _united(_at(_rod(14, 220), 0, 0, 0), _at(_rod(16, 95), 10, 0, 115, "y"))),
    "hook": (0.2, lambda: _swept(lambda s: 0 * s + 11.0, np.vstack([[[40.0, 0, -80.0]], _arc(40.0, 0.0, 200.0)]))),
    "doorstop": (0.1, lambda: _prism(np.array([[0, 0], [110, 0], [110, 12], [0, 45.0]]), 45.0)),
    "cone": (0.2, lambda: _revolved((0, 0), (36, 0), (38, 3), (5, 110), (0, 112))),
    "bracket": (0.3, lambda: _united(_box(80, 50, 22), _at(_box(22, 50, 80), -29, 0, 29))),
    "apple": (0.18, lambda: _ball(lambda n: 36 * n * (1 + 0.06 * np.sin(5 * n[:, :1]) * np.cos(4 * n[:, 1:2])))),
    "egg": (0.06, lambda: _ball(lambda n: n * [23, 23, 1] + n * [-3, -3, 0] * n[:, 2:] + n * [0, 0, 30])),
    "marker": (0.05, lambda: _revolved((0, 0), (11, 1), (11, 120), (8, 135), (0, 137))),
    "brick": (0.1, lambda: _united(_box(64, 32, 40), *(_at(_rod(9, 12), x, 0, 23) for x in (-18, 18)))),
    "spray": (0.4, _spray),
    "cup": (0.1, lambda: _revolved((0, 0), (30, 0), (40, 98), (39, 100), (37, 98), (28, 3), (0, 3))),
    "knob": (0.12, _star),
    "nut": (0.3, _nut),
    "lid": (0.25, _lid),
    "dumbbell": (0.8, lambda: _united(_rod(15, 150), *(_at(_rod(32, 38), 0, 0, z) for z in (-75, 75)))),
    "torch": (0.2, lambda: _revolved((0, 0), (15, 1), (15, 105), (24, 125), (24, 150), (0, 151))),
    "soap": (0.1, lambda: _ball(lambda n: np.sign(n) * np.abs(n) ** 0.6 * [42, 28, 18])),
    "pyramid": (0.2, _pyramid),
    "pear": (0.17, lambda: _revolved((0, 0), (20, 3), (35, 25), (33, 48), (18, 75), (12, 95), (5, 104), (0, 105))),
    "glass": (0.15, _glass),
    "tee": (0.3, lambda: _united(_at(_rod(17, 130), 0, 0, 0, "y"), _at(_rod(17, 80), 0, 0, -40))),
    "jar": (
        0.4,
        lambda: _revolved((0, 0), (36, 0), (38, 3), (38, 80), (30, 90), (30, 94), (33, 94), (33, 112), (0, 112)),
    ),
}
"""Mass [kg] and maker of every object."""
