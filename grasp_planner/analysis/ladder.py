"""The verdict as a ladder: what is true of a grasp, step by step, from the model on paper to a hand that closes.

Command line, viewer, exported page and report all show these five rungs; what a problem left out stands on the rung
it belongs to. A grasp stands as high as all rungs up to there are met.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..closing.closing import PUSH, close_grasps
from ..closing.report import ClosingReport
from ..grasp.grasp import Grasp
from ..grasp.verdict import NOTICED_FORCE, NOTICED_OVERLAP
from ..spatial import Pose

PALM_ERROR = 0.002
"""How far the palm is off, one way along each axis of O at a time, in the last rung [m]."""
SAMPLED = 0.8
"""Share of a disturbance that is held from any side where it is asked for in the directions of the load cases."""
NOT_MET = "only for a grasp that meets the model"
MODEL, CLEAR, HOLDS, CLOSES, SURVIVES = RUNGS = (
    "meets the model asked for",
    "clear of all links",
    "holds a push from any side",
    "closes from open",
    "survives errors",
)
"""Names of the rungs, from the first up."""


@dataclass(frozen=True)
class Rung:
    """One rung.

    Attributes:
        name: One of :data:`RUNGS`.
        met: Whether it is met; None if it has not been looked at, or makes no sense of this grasp.
        text: What was found, in words with numbers.
    """

    name: str
    met: bool | None
    text: str

    @property
    def mark(self) -> str:
        """A sign for people: met, not met, open."""
        return "–" if self.met is None else "✔" if self.met else "✘"

    @property
    def sentence(self) -> str:
        """Sign, name and what was found."""
        return f"{self.mark} {self.name}: {self.text}"


def model_rung(grasp: Grasp) -> Rung:
    """Return whether every requirement of the grasp's own problem is met, and what that problem leaves out."""
    if not grasp.feasible:
        failed = [found.text for found in grasp.failures().values()]
        return Rung(MODEL, False, ", ".join(failed if grasp.force_closed else [*failed, "not force-closed"]))
    left_out = _left_out(grasp)
    return Rung(MODEL, True, f"a plain problem, which leaves out {left_out}" if left_out else "every requirement")


def clear_rung(grasp: Grasp) -> Rung:
    """Return whether any link overlaps the object or another link, asked for or not."""
    found = {"the object": grasp.overlap("link_object"), "another link": grasp.overlap("self_collision")}
    deep = {what: depth for what, depth in found.items() if depth > NOTICED_OVERLAP}
    texts = [f"a link is {1e3 * depth:.1f} mm inside {what}" for what, depth in deep.items()]
    return Rung(CLEAR, not deep, "; ".join(texts) or "no overlap")


def holds_rung(grasp: Grasp) -> Rung:
    """Return the push that it holds from any side with the motors at rest, beside the one that decides.

    Load cases ask for a push along sampled directions, between which less is held: the rung wants that share.
    """
    if not grasp.feasible:
        return Rung(HOLDS, None, NOT_MET)
    size, asked = grasp.passive_margin.size, grasp.problem.loads.force or PUSH
    if math.isnan(size):
        return Rung(HOLDS, None, "not defined without contact stiffness")
    least = SAMPLED * asked
    held, wanted = _told_apart(size, least) if math.isfinite(size) else ("any push", f"{least:g}")
    text = held if size > min(NOTICED_FORCE, least) else "the slightest push makes it slip"
    why = f" ({asked:g} N asked along sampled directions)" if grasp.problem.loads.force else ""
    return Rung(HOLDS, size >= least, f"{text}; {wanted} N wanted{why}")


def closes_rung(grasp: Grasp) -> Rung:
    """Return whether the hand, closing from open, gets there and then holds."""
    if not grasp.feasible:
        return Rung(CLOSES, None, NOT_MET)
    return Rung(CLOSES, grasp.closing.holds, grasp.closing.text.partition(": ")[2])


def errors_rung(grasp: Grasp) -> Rung:
    """Return whether the same closing motion still ends in a hold when the palm is off to either side."""
    if not (grasp.feasible and grasp.closing.holds):
        return Rung(SURVIVES, None, "only for a grasp that closes")
    reports = palm_errors(grasp)
    held = sum(report.holds for report in reports)
    text = f"the palm {1e3 * PALM_ERROR:g} mm off: holds in {held} of {len(reports)} directions"
    return Rung(SURVIVES, held == len(reports), text)


def verdict_ladder(grasp: Grasp) -> tuple[Rung, ...]:
    """Return all rungs, from the first up; about a second of computation, most of it for the last one.

    Args:
        grasp: The grasp.

    Returns:
        Five rungs.
    """
    return model_rung(grasp), clear_rung(grasp), holds_rung(grasp), closes_rung(grasp), errors_rung(grasp)


def height(rungs: Sequence[Rung]) -> int:
    """Return how many rungs are met one after the other, from the first up."""
    unmet = [index for index, rung in enumerate(rungs) if rung.met is not True]
    return unmet[0] if unmet else len(rungs)


def palm_errors(grasp: Grasp, error: float = PALM_ERROR) -> tuple[ClosingReport, ...]:
    """Return how the hand closes by the same references with its palm off to both sides of every axis.

    Nothing holds the object while the hand closes, and pushes are no stronger than the load cases.

    Args:
        grasp: The grasp.
        error: How far the palm is off [m].

    Returns:
        Six reports: +x, +y, +z, −x, −y, −z of O.
    """
    home = grasp.palm_pose
    palms = [Pose(home.rotation, home.translation + error * way) for way in np.vstack([np.eye(3), -np.eye(3)])]
    off = [replace(grasp, palm_pose=palm) for palm in palms]
    return tuple(close_grasps(off, grasp.closing.path, safety=1.0, free=True))


def _told_apart(size: float, least: float) -> tuple[str, str]:
    """Return a push and the least that is wanted [N] with as many decimals as show which of them is larger."""
    enough = size >= least
    decimals = next((count for count in range(2, 9) if (round(size, count) >= round(least, count)) == enough), 9)
    return f"{size:.{decimals}f} N", f"{round(least, decimals):g}" if decimals < 6 else f"{least:.{decimals}f}"


def _left_out(grasp: Grasp) -> str:
    """Return what the problem does not ask for, in words; empty if nothing of the ladder."""
    problem = grasp.problem
    clearance = problem.clearance
    kept = clearance.link_object == "geometry" and clearance.self_collision
    parts = [] if kept else ["clearances"]
    return " and ".join(parts if problem.loads.disturbed else [*parts, "disturbances"])
