"""The whole scene as MJCF text: hand with fixed palm, free object, every pair that may touch, options.

The world frame is the object frame O of the plan. The hand's own weight is compensated, as in the plan.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from xml.etree import ElementTree

import numpy as np

from ..collision.link_shapes import LinkShape, shape_pairs
from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..model.contact_model import CONTACT_MODELS, Frictionless, HardFinger, SoftFinger
from ..problem.problem import GraspProblem
from ..spatial import Array
from .mjcf_hand import add_hand, add_motors, mesh_vertices
from .mjcf_object import ObjectSolid, add_object, object_solids
from .protocol import Protocol
from .table import table_height
from .tips import Tip, colliding_solids, fingertips
from .xml_text import Element, add

COMPLIANCE_NOTE = 1e-5
"""Violation of the compliance law from which on the prediction is said not to be exact [rad]."""


@dataclass(frozen=True)
class Scene:
    """A scene.

    Attributes:
        xml: MJCF text; it needs no other file.
        tip_names: Names of the fingertips' geometries, in the order of the contacts.
        object_names: Names of the object's geometries that fingertips touch.
        mass: Mass of the object [kg].
        friction: Coefficient of friction, one number or one for each contact.
        notes: What is not exactly as planned, one sentence each.
        table_depth: How far the table is below the object's centre of mass [m]; 0 without one.
    """

    xml: str
    tip_names: tuple[str, ...]
    object_names: tuple[str, ...]
    mass: float
    friction: float | tuple[float, ...]
    notes: tuple[str, ...]
    table_depth: float = 0.0


def build_scene(grasp: Grasp, protocol: Protocol) -> Scene:
    """Return the scene of a grasp for a protocol.

    Args:
        grasp: The grasp.
        protocol: The test.

    Returns:
        The scene.

    Raises:
        InvalidValueError: If the hand or the object can't be simulated.
    """
    problem, hand = grasp.problem, grasp.problem.hand
    tips = fingertips(grasp)
    solids = colliding_solids(grasp, tips) if protocol.geometry == "links" else ()
    pieces, object_note = object_solids(problem.grasp_object)
    mass = problem.grasp_object.mass if protocol.mass is None else protocol.mass
    friction = problem.parameters.friction if protocol.friction is None else protocol.friction
    touches = _touches(problem, protocol)
    root = ElementTree.Element("mujoco", model=hand.name)
    _add_options(root, protocol, problem.parameters.gravity if protocol.gravity else np.zeros(3))
    # Nothing collides but the pairs listed below.
    add(add(root, "default"), "geom", contype="0", conaffinity="0")
    assets = add(root, "asset")
    world = add(root, "worldbody")
    object_names = add_object(world, problem.grasp_object, mass, pieces)
    for_tips, for_links = (
        [name for name, piece in zip(object_names, pieces, strict=True) if piece.touched_by in (who, "all")]
        for who in ("tips", "links")
    )
    bodies = add_hand(world, problem, grasp.configuration.root_pose, solids, protocol.joint_friction)
    for tip in tips:
        add(bodies[tip.joint], "geom", name=f"tip_{tip.name}", type="sphere", pos=tip.centre, size=[tip.radius])
    _add_meshes(assets, solids, pieces)
    names = [f"solid_{number}_{shape.name}" for number, shape in enumerate(solids)]
    contact = add(root, "contact")
    by_name = dict(zip(names, solids, strict=True))
    _add_object_pairs(contact, tips, by_name, (for_tips, for_links), protocol, touches)
    _add_hand_pairs(contact, grasp, tips, by_name, protocol, touches[-1])
    table_depth = 0.0
    if protocol.table:
        table_depth = table_height(problem)
        _add_table(world, contact, problem.up, table_depth, (*for_tips, *names), protocol, touches[-1])
    add_motors(root, problem)
    equality = root.find("equality")
    assert equality is not None
    add(equality, "weld", name="hold", body1="object", active="false", solref=[0.004, 1.0], solimp=[0.99, 0.99, 0.001])
    notes = [object_note]
    if any(tip.is_point for tip in tips):
        notes.append("point fingertips: their links overlap the object as planned and do not touch it")
    if len({touch.sliding for touch in touches}) > 1:
        notes.append(
            f"everything but the fingertips rubs with the least friction of the plan, μ {touches[-1].sliding:g}"
        )
    if protocol.geometry == "contacts":
        notes.append("only the fingertips collide")
    off = grasp.violations["compliance"].value
    if off > COMPLIANCE_NOTE:
        notes.append(f"the synergies can't give these forces exactly: joints off by up to {off:.2g} rad")
    xml = ElementTree.tostring(root, encoding="unicode")
    tip_names = tuple(f"tip_{tip.name}" for tip in tips)
    return Scene(xml, tip_names, tuple(for_tips), mass, friction, tuple(notes), table_depth)


def _add_table(
    world: Element,
    contact: Element,
    up: Array,
    depth: float,
    touching: tuple[str, ...],
    protocol: Protocol,
    touch: _Touch,
) -> None:
    """Add a table that can be lowered, and the pairs of it with object and links."""
    body = add(world, "body", name="table", mocap="true", pos=-depth * up, zaxis=up)
    add(body, "geom", name="table_top", type="plane", size=[1.0, 1.0, 0.1])
    for name in touching:
        _add_pair(contact, "table_top", name, protocol, touch)


def _add_options(root: Element, protocol: Protocol, gravity: np.ndarray) -> None:
    """Add compiler and simulator options."""
    add(root, "compiler", angle="radian", autolimits="true", balanceinertia="true")
    option = add(
        root,
        "option",
        timestep=protocol.timestep,
        gravity=gravity,
        integrator="implicitfast",
        cone="elliptic",
        impratio=protocol.impratio,
        noslip_iterations=protocol.noslip_iterations,
        ccd_tolerance=1e-9,
        # At its default of 1e-8 the solver's noise is enough to shake fingertips loose.
        tolerance=1e-14,
        iterations=200,
        ls_iterations=100,
    )
    # A diverged simulation has to stay diverged: MuJoCo would put the object back where it was planned.
    add(option, "flag", autoreset="disable")


def _add_meshes(assets: Element, solids: tuple[LinkShape, ...], pieces: tuple[ObjectSolid, ...]) -> None:
    """Add the vertices of convex hulls."""
    for number, shape in enumerate(solids):
        vertices = mesh_vertices(shape)
        if vertices is not None:
            add(assets, "mesh", name=f"mesh_solid_{number}_{shape.name}", vertex=vertices.ravel())
    for number, piece in enumerate(pieces):
        if piece.vertices is not None:
            add(assets, "mesh", name=f"mesh_object_{number}", vertex=piece.vertices.ravel())


@dataclass(frozen=True)
class _Touch:
    """How a pair of geometries rubs.

    Attributes:
        sliding: Coefficient of friction; 0 for none.
        torsion: Torsional friction [m]; 0 for none.
    """

    sliding: float
    torsion: float


def _touches(problem: GraspProblem, protocol: Protocol) -> tuple[_Touch, ...]:
    """Return how every fingertip rubs, and last everything else of the hand.

    MuJoCo's elliptic cone f_n² ≥ |f_t|²/μ² + m²/(μ γ)² is that of the soft finger.

    Raises:
        InvalidValueError: If MuJoCo has no contacts of the plan's kind.
    """
    if not isinstance(problem.contact_model, HardFinger | SoftFinger | Frictionless):
        allowed = f"{', '.join(CONTACT_MODELS)}, to be simulated"
        raise InvalidValueError("contact_model", problem.contact_model.text, allowed)
    model, rough = problem.contact_model, protocol.friction
    sliding = problem.friction if rough is None else np.full(len(problem.frames), rough)
    if rough is None and not model.has_friction:
        sliding = np.zeros(len(problem.frames))
    torsion = sliding * (model.torsion if isinstance(model, SoftFinger) else 0.0)
    if protocol.torsional_friction is not None:
        torsion = np.full(len(problem.frames), protocol.torsional_friction)
    tips = [_Touch(*values) for values in zip(sliding.tolist(), torsion.tolist(), strict=True)]
    return *tips, _Touch(float(sliding.min()), float(torsion.min()))


def _add_pair(contact: Element, first: str, second: str, protocol: Protocol, touch: _Touch) -> None:
    """Add a pair of geometries that may touch."""
    condim = "1" if touch.sliding == 0.0 else "4" if touch.torsion > 0.0 else "3"
    add(
        contact,
        "pair",
        geom1=first,
        geom2=second,
        condim=condim,
        friction=[touch.sliding, touch.sliding, touch.torsion, 0.0, 0.0],
        solref=protocol.solref,
        solimp=protocol.solimp,
    )


def _add_object_pairs(
    contact: Element,
    tips: tuple[Tip, ...],
    solids: dict[str, LinkShape],
    object_names: tuple[list[str], list[str]],
    protocol: Protocol,
    touches: tuple[_Touch, ...],
) -> None:
    """Add the pairs of the hand and the object; links around point fingertips do not touch it."""
    exempt = {tip.joint for tip in tips if tip.is_point}
    touching = [f"tip_{tip.name}" for tip in tips]
    links = [name for name, shape in solids.items() if shape.joint not in exempt]
    for names, others in zip((touching, links), object_names, strict=True):
        for name, other in product(names, others):
            touch = touches[touching.index(name)] if name in touching else touches[-1]
            _add_pair(contact, name, other, protocol, touch)


def _add_hand_pairs(
    contact: Element,
    grasp: Grasp,
    tips: tuple[Tip, ...],
    solids: dict[str, LinkShape],
    protocol: Protocol,
    touch: _Touch,
) -> None:
    """Add the pairs within the hand that its description does not ignore; spherical fingertips count, points do not.

    What stands for two meshes and overlaps with the hand at rest would push them apart though the meshes are clear: as
    in the search it does not collide.
    """
    if protocol.geometry == "contacts":
        return
    kept = {frozenset((i, j)) for i, j in shape_pairs(grasp.problem.hand, tuple(solids.values()))}
    ignored = {frozenset(pair) for pair in grasp.problem.hand.description.collision.ignore}
    mine = [(name, shape.link, shape.joint) for name, shape in solids.items()]
    # The ball of a patch is the link's surface there only; elsewhere it may stand out, and the link's solids collide.
    patches = {frame.name for frame in grasp.problem.frames if frame.patch is not None}
    whole = (tip for tip in tips if not tip.is_point and tip.name not in patches)
    mine += [(f"tip_{tip.name}", tip.link, tip.joint) for tip in whole]
    for j, (name, link, joint) in enumerate(mine):
        for i, (other, other_link, other_joint) in enumerate(mine[:j]):
            if j < len(solids) and frozenset((i, j)) not in kept:
                continue
            if joint != other_joint and link != other_link and frozenset((link, other_link)) not in ignored:
                _add_pair(contact, other, name, protocol, touch)
