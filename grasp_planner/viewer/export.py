"""A grasp as one HTML file that opens offline: the scene, its closing animation and its numbers."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

from ..files.writing import write_text
from ..grasp.grasp import Grasp
from .export_text import export_overlay
from .glossary_script import glossary_script
from .narrow_script import narrow_script
from .opening import approach
from .scene.draw_grasp import DisplayOptions, fitting_scale
from .scene.picture3d import Picture
from .server import LocalServer
from .session import Preview, Session

FRAMES = 45
"""Postures of the closing animation."""
RATE_HZ = 30.0
ASIDE = 0.1
"""How far to the right the grasp is seen, beside its numbers, as a share of the camera's distance."""
REST_S = 2.0
"""How long the closed grasp rests before the animation starts again [s]."""


def grasp_html(grasp: Grasp, title: str | None = None) -> str:
    """Return a self-contained web page of a grasp.

    Args:
        grasp: The grasp.
        title: Heading; the hand and the object if left out.

    Returns:
        The HTML text, about 1 MB; it loads nothing from anywhere.
    """
    heading = title or f"{grasp.problem.hand.description.title or grasp.problem.hand.name}"
    server = LocalServer()
    try:
        session = Session(grasp)
        picture = Picture(server)
        picture.aim(grasp, aside=ASIDE)
        options = DisplayOptions(force_scale=fitting_scale(grasp))
        # An ellipsoid for every posture on the way would be half of the file.
        moving = replace(options, force_ellipsoid=False)
        picture.draw(session, options)
        server.flush()
        time.sleep(0.05)
        serializer = server.get_scene_serializer()
        for q in approach(grasp, FRAMES):
            posture = Grasp(grasp.problem, q, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces)
            session.preview = Preview(posture, "")
            picture.draw(session, moving)
            serializer.insert_sleep(1.0 / RATE_HZ)
        session.preview = None
        picture.draw(session, options)
        serializer.insert_sleep(REST_S)
        page = serializer.as_html()
    finally:
        server.stop()
    overlay = export_overlay(grasp, heading)
    end = page.rindex("</body>")
    scripts = "".join(f"<script>{script}</script>" for script in (narrow_script(), glossary_script()))
    return f"{page[:end]}{overlay}{scripts}{page[end:]}"


def export_html(grasp: Grasp, path: Path, title: str | None = None) -> None:
    """Write a grasp as a self-contained web page.

    Args:
        grasp: The grasp.
        path: File to write.
        title: Heading.

    Raises:
        FileFormatError: If the file can't be written.
    """
    write_text(path, grasp_html(grasp, title))
