"""A film of a hand that closes, as an animated GIF, with the look of the pictures."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from ..files.writing import replacing
from ..grasp.grasp import Grasp
from ..spatial import Array
from .camera import good_view
from .raster import render
from .solids import floor_of, framed, grasp_scene, hand_solids, object_solid

FILM_SIZE = (480, 360)
"""Width and height of a film [pixels]."""
FRAME_MS, REST_MS = 80, 1500
"""How long a posture and the closed hand are shown [ms]."""
COLOURS = 256


def save_film(grasp: Grasp, postures: Sequence[Array] | Array, path: Path) -> None:
    """Draw a hand on its way into a grasp as a GIF that starts over again.

    Args:
        grasp: The grasp, which is shown last, with its forces.
        postures: The way there, q [rad], each of shape (n_q,).
        path: File to write.

    Raises:
        FileFormatError: If the file can't be written.
    """
    problem, end = grasp.problem, grasp_scene(grasp)
    eye, target = good_view(grasp)
    hands = [hand_solids(problem.hand, q, grasp.palm_pose) for q in postures]
    body = object_solid(problem.grasp_object)
    everything = [*end.solids, *(solid for hand in hands for solid in hand)]
    view = framed(everything, eye - target, *FILM_SIZE)
    floor = floor_of([solid for solid in everything if not solid.floor])
    frames = [render([*hand, body, floor], view) for hand in hands]
    frames.append(render([*(solid for solid in end.solids if not solid.floor), floor], view))
    images = [Image.fromarray(np.asarray(frame)).quantize(COLOURS, dither=Image.Dither.NONE) for frame in frames]
    buffer = io.BytesIO()
    pauses = [FRAME_MS] * len(postures) + [REST_MS]
    images[0].save(buffer, "GIF", save_all=True, append_images=images[1:], duration=pauses, loop=0, optimize=True)
    with replacing(path) as file:
        file.write(buffer.getvalue())
