"""A simulation as one HTML file that opens offline: hand and object as they moved, and what came of it."""

from __future__ import annotations

import html
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from ..exceptions import InvalidValueError
from ..files.writing import write_text
from ..grasp.grasp import Grasp
from ..problem.settings import text_of_numbers
from ..simulate import Frame, Simulation
from ..spatial import Pose
from .scene.draw_grasp import DisplayOptions
from .scene.picture3d import Picture
from .server import LocalServer
from .session import Preview, Session
from .text import object_words

REST_S = 1.0
"""How long the end is shown before the animation starts again [s]."""
FAR = 0.4
"""An object farther than this from where it was planned is drawn there [m]."""
CARD = "background:#fffd;border-radius:8px;padding:8px 12px;margin-bottom:8px;font:13px system-ui,sans-serif;"


def simulation_html(found: Simulation) -> str:
    """Return a self-contained web page of a recorded simulation.

    Args:
        found: The simulation, recorded.

    Returns:
        The HTML text; it loads nothing from anywhere.

    Raises:
        InvalidValueError: If nothing was recorded.
    """
    if not found.frames:
        raise InvalidValueError("frames", 0, "a recorded simulation that was not refused")
    server = LocalServer()
    try:
        session = Session(found.grasp)
        picture = Picture(server)
        picture.aim(found.grasp)
        options = DisplayOptions(
            force_ellipsoid=False, forces=False, cones=False, contacts=False, task=False, weight=False, clearances=False
        )
        _show(session, found.grasp, found.frames[0])
        picture.draw(session, options)
        server.flush()
        time.sleep(0.05)
        serializer = server.get_scene_serializer()
        last = found.frames[0].time
        for frame in found.frames[1:]:
            serializer.insert_sleep(max(frame.time - last, 0.0))
            last = frame.time
            _show(session, found.grasp, frame)
            picture.draw(session, options)
        serializer.insert_sleep(REST_S)
        page = serializer.as_html()
    finally:
        server.stop()
    end = page.rindex("</body>")
    return page[:end] + _overlay(found) + page[end:]


def export_simulation_html(found: Simulation, path: Path) -> None:
    """Write a recorded simulation as a self-contained web page.

    Args:
        found: The simulation, recorded.
        path: File to write.

    Raises:
        InvalidValueError: If nothing was recorded.
        FileFormatError: If the file can't be written.
    """
    write_text(path, simulation_html(found))


def _show(session: Session, grasp: Grasp, frame: Frame) -> None:
    """Put hand and object where they were."""
    position = np.array(frame.object_pose[:3])
    distance = float(np.linalg.norm(position))
    position *= min(1.0, FAR / max(distance, 1e-12))
    w, x, y, z = (float(value) for value in frame.object_pose[3:])
    at = Pose(pin.Quaternion(np.array([x, y, z, w])).normalized().matrix(), position)
    session.live = replace(session.live, object_pose=at)
    # The palm is fixed in the world; a grasp knows it in the frame of the object.
    posture = Grasp(grasp.problem, frame.joint_angles, at.inverse() * grasp.palm_pose, grasp.delta_sigma)
    session.preview = Preview(posture, "")


def _overlay(found: Simulation) -> str:
    """Return the HTML laid over the scene: verdict and loads."""
    rows = "".join(
        f"<tr><td>{report.kind} {report.direction}</td><td>{'held' if report.held else 'lost'}</td>"
        f"<td>{_load(report.kind, report.load_held)}</td></tr>"
        for report in found.directions
    )
    colour = "#137333" if found.passed else "#b3261e"
    problem = found.grasp.problem
    table = found.protocol.table
    what, strength = ("shake", f"{found.protocol.shake:g} m/s²") if table else ("push", f"{found.protocol.force:g} N")
    return (
        "<div style='position:fixed;left:12px;top:12px;z-index:1000;max-width:340px;pointer-events:none'>"
        f"<div style='{CARD}'><b>{html.escape(problem.hand.description.title or problem.hand.name)}</b><br>"
        f"{html.escape(object_words(problem.grasp_object))}<br>{html.escape(found.protocol.name)}: {found.mass:g} kg, "
        f"μ {text_of_numbers(found.friction)}, {problem.n_synergies} synergies</div>"
        f"<div style='{CARD}color:{colour}'>{html.escape(found.verdict)}</div>"
        f"<div style='{CARD}'><table style='width:100%;font-size:12px'><tr><th align=left>{what}</th>"
        "<th align=left>"
        f"at {strength}</th><th align=left>held up to</th></tr>{rows}</table></div></div>"
    )


def _load(kind: str, load: float | None) -> str:
    """Return a load in words."""
    if load is None:
        return "–"
    return f"{load:.2f} N" if kind == "force" else f"{1e3 * load:.0f} N mm"
