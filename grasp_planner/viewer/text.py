"""The words and tables of the page. Plain strings in, escaped HTML or Markdown out; no display code here."""

from __future__ import annotations

import math
from pathlib import Path

from ..analysis.measured_contacts import contact_set
from ..analysis.measures import measure_contacts
from ..grasp.grasp import FEASIBILITY_TOLERANCE, Grasp
from ..grasp.joint_rows import joint_rows
from ..grasp.verdict import Violation
from ..model.task_direction import TaskDirection
from ..objects.base import GraspObject
from ..objects.mesh_object import MeshObject
from ..problem.term import METRE, Unit
from ..terms.posture import JointLimits
from ..values import number_text
from .live import contact_share
from .scene.margin import withstands

PHRASES = {
    "surface": "fingertips are off the surface by up to",
    "region": "a contact is outside the part that may be touched, by",
    "friction": "a contact force leaves its friction cone by",
    "joint_limit": "a joint is beyond its limit by",
    "compliance": "synergies and joint springs do not give this posture; off by",
    "tension": "a tendon would have to push, or its motor to pull too hard, by",
    "equilibrium_force": "forces do not balance; off by",
    "equilibrium_moment": "torques do not balance; off by",
    "link_object": "a link is inside the object by",
    "joint_centre": "a joint is inside the object by",
    "self_collision": "two links are inside each other by",
    "ground": "a link is below the ground by",
}
"""How a violation reads; others are named as they are."""

GREEN, RED, AMBER = "#1b8a5a", "#c62839", "#b7791f"
CARD = (
    "font-family:system-ui,sans-serif;font-size:13px;line-height:1.45;margin:6px 10px;padding:10px 12px;"
    "border-radius:10px;color:var(--mantine-color-text,#1d2433);background:var(--mantine-color-default-hover,#f4f6fa);"
)


def fixed(value: float, decimals: int = 2) -> str:
    """Return a number with a fixed number of decimals, without a negative zero."""
    if not math.isfinite(value):
        return number_text(value)
    return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", "−")


def degrees(value: float) -> str:
    """Return an angle for people."""
    if math.isnan(value):
        return "–"
    return "0°" if abs(value) < 0.005 else f"{number_text(value, 2 if abs(value) < 10.0 else 3)}°"


def quantity(value: float, unit: Unit) -> str:
    """Return a value in the unit that people read it in."""
    return f"{number_text(value * unit.shown_times)} {shown_unit(unit)}".rstrip()


def shown_unit(unit: Unit) -> str:
    """Return the unit in which people read a value; empty for a plain number."""
    return unit.shown_as or unit.symbol.removeprefix("1")


def readable(name: str) -> str:
    """Return the name of a term as words."""
    return name.replace("_", " ")


def reason(violation: Violation) -> str:
    """Return one reason why a grasp is not feasible, as words."""
    phrase = PHRASES.get(violation.name, f"{readable(violation.name)} violated by")
    return f"{phrase} {quantity(violation.value, violation.unit)}"


def reasons(grasp: Grasp) -> list[str]:
    """Return all reasons why a grasp is not feasible, the geometric ones first."""
    failures = tuple(grasp.failures().values())
    if contact_share(grasp) == 0.0:
        # Without contact there are no forces that could break any other requirement.
        return [reason(failure) for failure in failures if failure.unit == METRE or failure.name == JointLimits.name]
    order = sorted(failures, key=lambda failure: (failure.unit != METRE, -failure.value))
    found = [reason(failure) for failure in order]
    return found if grasp.force_closed else [*found, "the contacts are not force-closed"]


def object_words(grasp_object: GraspObject) -> str:
    """Return what is held: its shape, how large its bounding box is, its mass."""
    shape = f"mesh {Path(grasp_object.path).name}" if isinstance(grasp_object, MeshObject) else grasp_object.kind
    size = " × ".join(number_text(2e3 * half) for half in grasp_object.half_extents)
    return f"{shape}, {size} mm, {number_text(1e3 * grasp_object.mass)} g"


def task_words(task: TaskDirection) -> str:
    """Return a task: what is to be done along or about which direction of O."""
    linear, angular = task.direction[:3], task.direction[3:]
    turns = task.kind == "torque" or not linear.any()
    part = angular if turns else linear
    axis = int(abs(part).argmax())
    sign = "−" if part[axis] < 0.0 else "+"
    along = f"{sign}{'xyz'[axis]}" if abs(part[axis]) == 1.0 else f"({', '.join(fixed(value) for value in part)})"
    return f"{task.kind} {'about' if turns else 'along'} {along}"


def story(grasp: Grasp) -> str:
    """Return short paragraphs (Markdown): the synergies, why it holds, what the task does."""
    return "\n\n".join([synergy_story(grasp), why_story(grasp), task_story(grasp)])


def synergy_story(grasp: Grasp) -> str:
    """Return how few motors move how many joints (Markdown)."""
    problem = grasp.problem
    n_s, n_q = problem.n_synergies, problem.hand.n_joints
    springs = "Springs in the joints let the fingers give way where they touch."
    few = f"{n_q} joints, but only **{n_s}** motor command{'s' if n_s > 1 else ''}"
    count = few if n_s < n_q else f"As many motor commands as joints, **{n_s}**: nothing is saved yet"
    return f"**Synergies.** {count}; each synergy moves all fingers together. {springs}"


def why_story(grasp: Grasp) -> str:
    """Return why the grasp holds, or why not, and what it withstands (Markdown)."""
    if not grasp.feasible:
        return "**Why it does not hold.** " + "; ".join(reasons(grasp)[:2]) + "."
    weakest = int(grasp.friction_margins.argmin())
    name, margin = grasp.problem.frames[weakest].name, float(grasp.friction_margins[weakest])
    share = grasp.force_norm / grasp.force_norm_floor
    spare = f"with {fixed(margin, 3)} N to spare" if margin > 1e-3 else "right at the edge of its cone"
    return (
        f"**Why it holds.** Every red force stays inside its cone; the closest call is **{name}**, {spare}. "
        f"The hand presses {fixed(share)} × as hard as the best hand would have to at these points."
        f"\n\n{withstands(grasp)}"
    )


def task_story(grasp: Grasp) -> str:
    """Return what the first task direction means for this grasp (Markdown)."""
    task = grasp.problem.tasks[0]
    ratio, (angle, degenerate) = grasp.transmission_ratios[0], grasp.alignments[0]
    verb = {"force": "Pushing", "torque": "Turning", "twist": "Moving"}[task.kind]
    effort = "unit of synergy speed" if task.is_motion else "unit of motor effort"
    if ratio > 1e4:
        meaning = "costs the motors next to nothing: the structure of the hand carries it"
    else:
        meaning = f"gives {number_text(ratio)} per {effort}"
    unbounded = degenerate and angle < 1.0
    shape = "the ellipsoid is unbounded there" if unbounded else f"the arrow is {degrees(angle)} off its long axis"
    return f"**Task.** {verb} along the green arrow ({task_words(task)}) {meaning}; {shape}."


def contact_table(grasp: Grasp, *, in_contact: bool = True) -> str:
    """Return the table of all contacts (Markdown)."""
    rows = ["| contact | gap mm | f_n N | friction margin N |", "|---|--:|--:|--:|"]
    for i, frame in enumerate(grasp.problem.frames):
        gap = fixed(1e3 * float(grasp.contacts.gaps[i]))
        force = fixed(float(grasp.normal_forces[i]), 3) if in_contact else "–"
        margin = fixed(float(grasp.friction_margins[i]), 3) if in_contact else "–"
        rows.append(f"| {frame.name} | {gap} | {force} | {margin} |")
    return "\n".join(rows)


def violation_table(grasp: Grasp) -> str:
    """Return the table of every requirement (Markdown)."""
    rows = ["| requirement | violation | |", "|---|--:|---|"]
    for name, found in grasp.violations.items():
        mark = "✔" if found.value <= FEASIBILITY_TOLERANCE else "✘"
        rows.append(f"| {readable(name)} | {quantity(found.value, found.unit)} | {mark} |")
    rows.append(f"| force closure | {number_text(grasp.force_closure_margin)} | {'✔' if grasp.force_closed else '✘'} |")
    return "\n".join(rows)


def measure_table(grasp: Grasp, *, in_contact: bool = True) -> str:
    """Return the measures that matter most and take no time, group by group (Markdown)."""
    if not in_contact:
        return "*The fingertips do not touch.*"
    rows = ["| measure | value | |", "|---|--:|---|"]
    for measure in measure_contacts(contact_set(grasp), everything=False, quick=True):
        value = measure.text or number_text(measure.value)
        says = measure.says.replace("|", "\\|")
        rows.append(f"| {measure.name} | {value} {measure.unit} | {says} |")
    return "\n".join([*rows, "", "*ε and all others: `grasp-planner analyse --all`.*"])


def joint_table(grasp: Grasp) -> str:
    """Return the table of all joints (Markdown): q, q_r, torque, and which are at a limit."""
    rows = ["| joint | q ° | q_r ° | τ mN m |", "|---|--:|--:|--:|"]
    for row in joint_rows(grasp):
        limit = " ⚠" if row.at_limit else ""
        rows.append(
            f"| {row.name}{limit} | {fixed(row.angle, 1)} | {fixed(row.reference, 1)} | {fixed(row.torque, 0)} |"
        )
    return "\n".join(rows)


def contact_details(grasp: Grasp, index: int) -> str:
    """Return all numbers of one contact (Markdown)."""
    frame, force, moment = grasp.problem.frames[index], grasp.forces[index], grasp.moments[index]
    normal, friction = float(grasp.normal_forces[index]), float(grasp.problem.friction[index])
    slip = math.sqrt(max(float(force @ force) - normal**2, 0.0))
    share = 1.0 - float(grasp.friction_margins[index]) / (friction * normal) if normal > 0.0 else math.inf
    torque = f", torque {number_text(1e3 * math.sqrt(float(moment @ moment)))} mN m" if moment.any() else ""
    cone = f"uses {number_text(100 * share)} % of its friction cone (μ = {friction:g})"
    point = ", ".join(fixed(1e3 * float(value), 1) for value in grasp.contacts.points[index])
    return (
        f"**Contact {frame.name}** on {frame.link}\n\n"
        f"- point in O: ({point}) mm, gap {fixed(1e3 * float(grasp.contacts.gaps[index]), 3)} mm\n"
        f"- normal force {number_text(normal)} N, tangential {number_text(slip)} N{torque}\n"
        f"- {cone if grasp.problem.contact_model.has_friction else 'no friction'}"
    )
