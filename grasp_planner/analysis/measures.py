"""What a grasp is worth in numbers, in groups, each with a sentence: planned, or contacts from elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..exceptions import InvalidValueError
from ..model.force_closure import HARD
from ..model.friction import friction_margins
from ..model.manipulability import force_manipulability, kinematic_manipulability
from ..model.quasi_static import CompliantGrasp
from ..model.stiffness import grasp_stiffness, principal_stiffness
from ..model.subspaces import commanded_forces, grasp_subspaces, rigid_body_motions
from . import quality
from .force_optimisation import ForceProblem, best_forces
from .friction_cost import ContactLimits, contact_cost
from .measured_contacts import ContactSet, JointRange
from .robustness import Heuristic, contact_robustness, grasp_robustness
from .wrench_edges import edge_wrenches, min_weight, wrench_volume
from .wrench_space import epsilon, reach, task_epsilon

MOST_CONTACTS = 5
"""Most contacts of which PGR tries all 3^n_c states, which takes half a second."""
FLAT = 1e-6
"""Share of the largest singular value below which wrenches lie in a plane."""


@dataclass(frozen=True)
class Measure:
    """One number or word about a grasp.

    Attributes:
        group: What it is about.
        name: Its name.
        value: The number; not a number where there is none.
        unit: Its unit; empty for a pure number.
        says: One sentence.
        main: Whether it is among the ones that matter most.
        text: A word instead of a number.
    """

    group: str
    name: str
    value: float
    unit: str
    says: str
    main: bool = False
    text: str = ""


def measure_contacts(contacts: ContactSet, *, everything: bool = True, quick: bool = False) -> tuple[Measure, ...]:
    """Return the measures of contacts, in groups.

    Args:
        contacts: The contacts.
        everything: Whether all are computed, or only the ones that matter most.
        quick: Whether ε, volume and min-weight, which take tenths of a second, are left out.

    Returns:
        The measures; what lacks forces, a hand or stiffness is left out.
    """
    found = [*_wrenches(contacts, everything, quick), *_forces(contacts)]
    if contacts.springs is not None:
        found += [*_hand(contacts, contacts.springs), *_stiffness(contacts, contacts.springs, everything)]
    found += [*_shape(contacts), *_posture(contacts.joints)]
    return tuple(each for each in found if everything or each.main)


def _wrenches(contacts: ContactSet, everything: bool, quick: bool) -> list[Measure]:
    """Return what can be resisted."""
    group, unit = "wrenches it can exert", f"moments over {1e3 * contacts.length:.0f} mm"
    space = contacts.wrench_space()
    closure = quality.force_closure(contacts.points, contacts.normals, space.friction, contacts.model)[0]
    found = [
        Measure(group, "force-closure margin", closure, "", "above 0: the contacts can resist any wrench", True),
    ]
    if not quick:
        least = epsilon(space, tolerance=1e-3, max_points=250).value
        says = f"the least wrench, {unit}, that takes 1 N in all [Ferrari, Canny]"
        found.append(Measure(group, "ε, sum of normal forces 1 N", least, "N", says, True))
    if everything and not quick:
        each, weight = contacts.wrench_space("Linf"), edge_wrenches(space, 6)
        least, volume = epsilon(each, tolerance=1e-3, max_points=250).value, wrench_volume(space)
        even = len(weight) * min_weight(weight)[0]
        found += [
            Measure(group, "ε, every normal force 1 N", least, "N", f"the same with 1 N at each contact, {unit}"),
            *_for_tasks(contacts, group),
            *_against_load(contacts, group),
            Measure(group, "volume of wrenches", volume, "N⁶", "of pyramids of 8 edges, normal forces of 1 N in all"),
            Measure(group, "min-weight n·l*", even, "", "0 to 1: how evenly forces cancel"),
        ]
    scaled, about = space.grasp, f"of G, {unit}"
    return [
        *found,
        Measure(group, "σ_min(G)", quality.smallest_singular_value(scaled)[0], "", f"least singular value {about}"),
        Measure(group, "volume of G", quality.ellipsoid_volume(scaled)[0], "", f"product of singular values {about}"),
        Measure(group, "isotropy of G", quality.isotropy(scaled)[0], "", f"1: all wrenches alike; {about}"),
    ]


def _for_tasks(contacts: ContactSet, group: str) -> list[Measure]:
    """Return how far the wrenches reach for what is asked: pushes at the contacts, the wrenches of tasks.

    Pushes of 1 N in any direction, at any of the contacts, have an ellipsoid of wrenches, [Borst2004]; tasks are the
    corners of a task wrench space.
    """
    scale, space, found = np.repeat([1.0, contacts.length], 3), contacts.wrench_space(), []
    pushes = HARD.grasp_matrix(contacts.points - contacts.centre, contacts.normals) / scale[:, None]
    sides, sizes, _ = np.linalg.svd(pushes / math.sqrt(len(contacts.points)))
    if sizes.size == 6 and sizes[-1] > FLAT * sizes[0]:  # else no push turns the object about the contacts' line
        least = task_epsilon(space, sides * sizes, tolerance=1e-3).value
        says = "the least push at the contacts, as an ellipsoid of wrenches, that takes 1 N in all"
        found.append(Measure(group, "task ε, pushes at the contacts", least, "N", says))
    if contacts.tasks is not None:
        wrenches = contacts.tasks / scale
        size = np.linalg.norm(wrenches, axis=1)
        least = min(reach(space, row / each)[0] / each for row, each in zip(wrenches, size, strict=True))
        found.append(
            Measure(group, "task ε, given wrenches", float(least), "", "how many times them 1 N in all exerts")
        )
    return found


def _against_load(contacts: ContactSet, group: str) -> list[Measure]:
    """Return how far the wrenches reach along the one that holds the load, the task of [LiSastry1988] that is known."""
    if contacts.wrench is None or not contacts.wrench.any():
        return []
    load = contacts.wrench / np.repeat([1.0, contacts.length], 3)
    size = float(np.linalg.norm(load))
    says = f"along the wrench that holds the load, which is {size:.3g} N"
    return [Measure(group, "reach against the load", reach(contacts.wrench_space(), -load / size)[0], "N", says)]


def _forces(contacts: ContactSet) -> list[Measure]:
    """Return what the forces are worth."""
    group, found = "forces", []
    wrench = np.zeros(6) if contacts.wrench is None else contacts.wrench
    if contacts.forces is not None:
        sizes = np.linalg.norm(contacts.forces, axis=1)
        rest = np.abs(contacts.grasp_matrix @ contacts.forces.ravel() + wrench).max()
        found = [
            Measure(group, "norm of the forces", float(np.linalg.norm(sizes)), "N", "√Σ|f|² of all contacts", True),
            Measure(group, "largest force", float(sizes.max()), "N", "of any contact", True),
            Measure(group, "imbalance", float(rest), "N, N m", "largest entry of G f + w_ext"),
        ]
        limits = ContactLimits(contacts.least_friction, 0.0, 30.0)
        cost = contact_cost(contacts.forces, contacts.covectors, limits).value
        found.append(Measure(group, "V", cost, "N⁻²", "closeness to cones, 0 N and 30 N; Σ 1/(2 s²) over distances s"))
        if contacts.frictional.any():
            margins = friction_margins(contacts.forces, contacts.covectors, contacts.friction)
            spare = float(margins[contacts.frictional].min())
            says = "μ f_n − |f_t| of the worst contact"
            found.insert(2, Measure(group, "least friction to spare", spare, "N", says, True))
    if contacts.wrench is not None and contacts.wrench.any():
        given = (contacts.grasp_matrix, contacts.normals, contacts.friction, wrench)
        problem = ForceProblem(*given, model=contacts.model)
        for aim, says in (("norm", "of any forces that hold the load"), ("largest", "the least that suffices")):
            best = best_forces(problem, aim)  # type: ignore[arg-type]  # both are aims
            value = math.nan if best is None else best.value
            found.append(Measure(group, f"least possible {aim}", value, "N", says, aim == "norm"))
    return found


def _hand(contacts: ContactSet, springs: CompliantGrasp) -> list[Measure]:
    """Return what the motors can do."""
    group, length = "what motors can do", contacts.length
    spaces = grasp_subspaces(springs.grasp, springs.jacobian)
    internal, commanded = spaces.internal_forces.shape[1], commanded_forces(springs).shape[1]
    rigid = rigid_body_motions(springs)["object_motion"].shape[1]
    classes = ", ".join(spaces.classes) or "none"
    found = [
        Measure(group, "kind of grasp", math.nan, "", "by the null spaces of G and J", True, classes),
        Measure(group, "internal forces commanded", commanded, f"of {internal}", "dimensions the motors reach", True),
        Measure(group, "rigid motions", rigid, "", "dimensions in which motors move the object and bend no spring"),
        Measure(
            group,
            "σ_min(H)",
            quality.distance_to_singularity(springs.grasp, springs.jacobian)[0],
            "",
            "distance of hand and object from a singular posture",
        ),
        Measure(
            group, "manipulability", quality.manipulability(springs.grasp, springs.jacobian)[0], "", "product of σ(H)"
        ),
    ]
    moving = kinematic_manipulability(springs, length).ratios
    if len(moving):
        size = math.sqrt(max(float(moving[-1]), 0.0))
        found.append(Measure(group, "fastest rigid motion", size, "m/rad", "of the object per motor, turns at L"))
    felt = force_manipulability(springs, length).ratios
    if len(felt):
        best = 1.0 / math.sqrt(max(float(felt[0]), 1e-300))
        found.append(Measure(group, "motor force per newton", best, "m", "of the wrench the motors feel most"))
    return found


def _stiffness(contacts: ContactSet, springs: CompliantGrasp, everything: bool) -> list[Measure]:
    """Return how stiffly the object is held, and how robustly."""
    group = "stiffness and robustness"
    try:
        held = principal_stiffness(grasp_stiffness(springs))
    except InvalidValueError:
        return [Measure(group, "stiffness", 0.0, "N/m", "the springs do not hold the object", True)]
    away = float(np.linalg.norm(held.centre - 0.0))
    limits = ContactLimits(contacts.least_friction, 0.0, 30.0)  # the slipperiest contact counts for all
    pressed = contacts.contact_springs or springs
    robust = contact_robustness(pressed, contacts.covectors, limits).value
    found = [
        Measure(group, "softest shift", float(held.translational[0]), "N/m", "without preload, turning freely", True),
        Measure(group, "stiffest shift", float(held.translational[2]), "N/m", "without preload, turning freely"),
        Measure(group, "softest turn", float(held.rotational[0]), "N m/rad", "about the centre of compliance", True),
        Measure(group, "centre of compliance", 1e3 * away, "mm", "its distance from the object's centre"),
        Measure(group, "PCR", robust, "N²", "n_c/min V of the commanded forces up to 30 N [Pozzi]"),
    ]
    if everything:
        tried: Heuristic = "all" if len(contacts.points) <= MOST_CONTACTS else "H4"
        best = max(robust, grasp_robustness(pressed, contacts.covectors, limits, heuristic=tried).value)
        states = "any states" if tried == "all" else "states of heuristic H4"
        found.append(Measure(group, "PGR", best, "N²", f"the same with contacts in {states}: stuck, sliding, off"))
    return found


def _shape(contacts: ContactSet) -> list[Measure]:
    """Return where the contacts are."""
    group, points = "where the contacts are", contacts.points
    off = quality.centroid_distance(points, contacts.centre)[0]
    found = [Measure(group, "centroid off the centre", 1e3 * off, "mm", "less load turns the object if small")]
    if len(points) >= 3:
        area, uneven = 1e4 * quality.grasp_polygon_area(points)[0], quality.polygon_shape(points)[0]
        found += [
            Measure(group, "area of the polygon", area, "cm²", "of the contacts in their plane"),
            Measure(group, "unevenness of the polygon", uneven, "", "0: regular"),
        ]
    return found


def _posture(joints: JointRange | None) -> list[Measure]:
    """Return where the joints are."""
    if joints is None:
        return []
    group = "posture"
    centred = quality.joint_centring(joints.q, joints.lower, joints.upper)[0]
    away = math.degrees(quality.posture_deviation(joints.q, joints.mean)[0])
    return [
        Measure(group, "joints off the middle", centred, "", "0: all in the middle of their range, 1: all on a limit"),
        Measure(group, "distance from the mean", away, "°", "root mean square of the joints from q̄"),
    ]
