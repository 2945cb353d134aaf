"""What follows from a hand check: a description file to start from, and a report."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ..spatial import Array
from .check import FingerReport, HandCheck


def proposed_description(check: HandCheck, folder: Path | None = None) -> str:
    """Return the text of a description file (TOML) for a hand.

    Args:
        check: A check without errors.
        folder: Folder the file will be in; that of the URDF if left out.

    Returns:
        The text; what is guessed says so.
    """
    assert check.palm is not None
    urdf = (
        check.path.name if folder is None or folder.resolve() == check.path.parent.resolve() else check.path.resolve()
    )
    joints = [joint.name for joint in check.joints if not joint.mimics]
    palm = check.palm
    lines = [
        f"# Proposed from {check.path.name}; everything marked `guess` needs a look. SI units: m, rad, N.",
        f"name = {json.dumps(check.name)}",
        f"urdf = {json.dumps(str(urdf))}",
        "# The independent joints in the order of q; joints with a <mimic> follow them.",
        f"joints = {json.dumps(joints)}",
        "",
        "[palm]",
        f"link = {json.dumps(palm.link)}",
        f"normal = {_vector(palm.normal)}       # guess: where the fingertips go when the fingers close",
        f"closing_axis = {_vector(palm.closing_axis)} # guess: what they close around",
        f"grasp_centre = {_vector(palm.grasp_centre)} # guess: middle of the half-closed fingertips",
        "",
        "[compliance] # guess: the numbers of [Mavrogiannis2014]",
        "joint = 0.1             # C_q [rad/(N m)]; or a table with one number a joint",
        "structural = 0.1        # C_s [m/N]",
        "contact_stiffness = 1e5 # K_c [N/m]",
        "",
        "[contact_sets.sphere]",
        *(_contact(finger) for finger in check.fingers),
        "",
        "[collision] # neighbours in a chain",
        "ignore = [",
        *(f"  {json.dumps(list(pair))}," for pair in check.ignored),
        "]",
    ]
    return "\n".join(lines) + "\n"


def report_lines(check: HandCheck) -> list[str]:
    """Return the findings as lines of text."""
    lines = [f"{check.path}: {check.name}, {len(check.joints)} moving joints, {len(check.fingers)} fingers"]
    for finger in check.fingers:
        tip = finger.tip
        lines.append(f"finger {finger.name}: {' → '.join(finger.joints)}")
        lines.append(f"  tip {tip.frame} + {list(tip.offset)} m, radius {tip.radius:g} m ({tip.reason})")
    for joint in check.joints:
        follows = f", follows {joint.mimics}" if joint.mimics else ""
        lines.append(f"joint {joint.name}: {joint.lower:.4g} … {joint.upper:.4g} rad{follows}")
    if check.palm is not None:
        lines.append(
            f"palm {check.palm.link}: normal {_vector(check.palm.normal)}, closing axis "
            f"{_vector(check.palm.closing_axis)}, grasp centre {_vector(check.palm.grasp_centre)} m"
        )
    lines += [f"missing: {line}" for line in check.missing]
    return lines + [f"error: {line}" for line in check.errors]


def _contact(finger: FingerReport) -> str:
    """Return the line of a contact."""
    tip = finger.tip
    offset = f", offset = {list(tip.offset)}" if any(tip.offset) else ""
    return (
        f"{finger.name} = {{ frame = {json.dumps(tip.frame)}, radius = {tip.radius:g}{offset} }} # guess: {tip.reason}"
    )


def _vector(vector: Array) -> str:
    """Return a vector as TOML."""
    return "[" + ", ".join(f"{value + 0.0:.4f}" for value in np.round(vector, 4)) + "]"
