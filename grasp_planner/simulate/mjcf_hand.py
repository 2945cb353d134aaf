"""A hand as MJCF: one body a joint, joint springs C_q⁻¹, and one actuator a synergy; nothing stronger.

The springs pull each joint towards q̄ + S σ: the part towards q̄ is a passive spring, and actuator k pulls a fixed
tendon whose arms are K_q S_k, so that its control is σ_k itself; [Mavrogiannis2014] eq. (4), (10).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from ..collision.link_shapes import LinkShape
from ..exceptions import InvalidValueError
from ..hand.hand import Hand
from ..model.compliance import joint_stiffness
from ..problem.problem import GraspProblem
from ..spatial import Array
from .motors import STIFF, add_holds
from .xml_text import Element, add, pose_attributes

SPRING_RATE = 200.0
"""Natural frequency each spring gets by the armature of its joint [rad/s]; a geared motor's inertia is alike."""
FOLLOWER_SHARE = 0.1
"""Armature of a coupled joint, as a share of that of the joint it follows."""
LIMIT_PLAY = 1e-3
"""How far the stops lie beyond the joint limits [rad]: a plan at a limit does not lean on a stop."""
LEAST_MASS, LEAST_INERTIA = 1e-4, 1e-8
"""Floors of the mass [kg] and the principal moments [kg m²] of a link."""


def joint_axis(hand: Hand, joint: int) -> Array:
    """Return the unit axis of a joint that turns or slides in its own frame, of shape (3,)."""
    data, q = hand.model.createData(), np.zeros(hand.model.nv)
    q[hand.model.joints[joint].idx_q] = 1.0
    pin.forwardKinematics(hand.model, data, q)
    turned = hand.model.jointPlacements[joint].inverse() * data.liMi[joint]
    axis = np.array(turned.translation if slides(hand, joint) else pin.log3(turned.rotation))
    return axis / np.linalg.norm(axis)


def slides(hand: Hand, joint: int) -> bool:
    """Return whether a joint of the model slides."""
    return str(hand.model.joints[joint].shortname()).startswith("JointModelP")


def spring_stiffness(problem: GraspProblem) -> Array:
    """Return K_q = C_q⁻¹ of the independent joints [N m/rad], of shape (n_q, n_q).

    Raises:
        InvalidValueError: If a joint has no compliance: a rigid joint has no spring.
    """
    compliance = problem.joint_compliance
    if problem.rigid_joints.any():
        raise InvalidValueError("joint_compliance", compliance.tolist(), "> 0 for every joint, to be simulated")
    stiffness = joint_stiffness(compliance)
    return np.diag(stiffness) if stiffness.ndim == 1 else stiffness


def add_hand(
    world: Element, problem: GraspProblem, root: Any, shapes: Iterable[LinkShape], friction: float = 0.0
) -> dict[int, Element]:
    """Add the bodies of a hand with its palm fixed.

    Args:
        world: The world body.
        problem: The problem, for hand and compliance.
        root: Pose of the root of the URDF in the world, a Pose.
        shapes: Solids that collide, in the frames of their joints.
        friction: Dry friction of every independent joint [N m].

    Returns:
        Body of every joint; 0 is the palm.
    """
    hand, model = problem.hand, problem.hand.model
    stiffness, mean = np.diag(spring_stiffness(problem)), problem.synergies.mean
    alone = problem.joint_compliance.ndim == 1
    bodies = {0: add(world, "body", name="palm_root", **pose_attributes(root))}
    for joint in range(1, model.njoints):
        name = model.names[joint]
        place = pose_attributes(model.jointPlacements[joint])
        body = add(bodies[model.parents[joint]], "body", name=f"link_{name}", gravcomp=1.0, **place)
        _add_inertia(body, model.inertias[joint])
        index = model.joints[joint].idx_v
        source = int(np.flatnonzero(hand.coupling[index])[0])
        attributes: dict[str, Any] = {"stiffness": 0.0}
        armature = stiffness[source] / SPRING_RATE**2
        if name == hand.joint_names[source]:
            damping = 2.0 * np.sqrt(stiffness[source] * armature)
            spring = stiffness[source] if alone else 0.0
            attributes = {"stiffness": spring, "springref": mean[source], "damping": damping}
            attributes |= {"frictionloss": friction} if friction > 0.0 else {}
        else:
            armature *= FOLLOWER_SHARE
        limits = model.lowerPositionLimit[index] - LIMIT_PLAY, model.upperPositionLimit[index] + LIMIT_PLAY
        axis = joint_axis(hand, joint)
        kind = "slide" if slides(hand, joint) else "hinge"
        add(body, "joint", name=name, type=kind, axis=axis, range=limits, armature=armature, **attributes)
        bodies[joint] = body
    for number, shape in enumerate(shapes):
        add_shape(bodies[shape.joint], f"solid_{number}_{shape.name}", shape)
    return bodies


def add_motors(root: Element, problem: GraspProblem) -> None:
    """Add the coupling of joints and one actuator for each synergy, whose control is σ_k [rad]."""
    hand, stiffness = problem.hand, spring_stiffness(problem)
    equality = add(root, "equality")
    for index, name in enumerate(tuple(hand.model.names)[1:]):
        source = int(np.flatnonzero(hand.coupling[index])[0])
        if name != hand.joint_names[source]:
            law = [hand.coupling_offset[index], hand.coupling[index, source], 0.0, 0.0, 0.0]
            joints = {"joint1": name, "joint2": hand.joint_names[source]}
            add(equality, "joint", **joints, polycoef=law, **STIFF)
    add_holds(equality, problem)
    tendons, actuators = add(root, "tendon"), add(root, "actuator")
    for k, arms in enumerate((stiffness @ problem.synergies.basis).T):
        _add_tendon(tendons, f"synergy_{k + 1}", hand, arms)
        add(actuators, "motor", name=f"sigma_{k + 1}", tendon=f"synergy_{k + 1}", gear=[1.0])
    if problem.joint_compliance.ndim == 2:
        # Springs across joints: K_q as a sum of springs along its eigenvectors.
        for k, (value, arms) in enumerate(zip(*_eigenpairs(stiffness), strict=True)):
            rest = float(arms @ problem.synergies.mean)
            _add_tendon(tendons, f"spring_{k + 1}", hand, arms, stiffness=value, springlength=rest)


def _add_tendon(tendons: Element, name: str, hand: Hand, arms: Array, **attributes: Any) -> None:
    """Add a tendon whose length is the sum of the joint angles, each times its arm."""
    tendon = add(tendons, "fixed", name=name, **attributes)
    for joint, arm in zip(hand.joint_names, arms, strict=True):
        if arm != 0.0:
            add(tendon, "joint", joint=joint, coef=arm)


def _eigenpairs(matrix: Array) -> tuple[Array, Array]:
    """Return eigenvalues and eigenvectors, these as rows."""
    values, vectors = np.linalg.eigh(matrix)
    return values, vectors.T


def add_shape(body: Element, name: str, shape: LinkShape) -> None:
    """Add a solid of a hand to the body of its joint.

    Raises:
        InvalidValueError: If MuJoCo has no such shape.
    """
    if shape.geometry is None:
        if np.array_equal(shape.start, shape.end):
            add(body, "geom", name=name, type="sphere", pos=shape.start, size=[shape.radius])
        else:
            add(body, "geom", name=name, type="capsule", fromto=[*shape.start, *shape.end], size=[shape.radius])
        return
    geometry, place = shape.geometry, pose_attributes(shape.placement)
    if isinstance(geometry, coal.Box):
        add(body, "geom", name=name, type="box", size=geometry.halfSide, **place)
    elif isinstance(geometry, coal.Cylinder):
        add(body, "geom", name=name, type="cylinder", size=[geometry.radius, geometry.halfLength], **place)
    elif isinstance(geometry, coal.Ellipsoid):
        add(body, "geom", name=name, type="ellipsoid", size=geometry.radii, **place)
    elif mesh_vertices(shape) is not None:
        add(body, "geom", name=name, type="mesh", mesh=f"mesh_{name}", **place)
    else:
        raise InvalidValueError(f"collision geometry {shape.name}", type(geometry).__name__, "a shape MuJoCo has")


def mesh_vertices(shape: LinkShape) -> Array | None:
    """Return the vertices of a mesh of a hand [m], of shape (n, 3); its convex hull collides. None for primitives."""
    geometry = shape.geometry
    if geometry is None or isinstance(geometry, coal.Box | coal.Cylinder | coal.Ellipsoid):
        return None
    if isinstance(geometry, coal.ConvexBase):  # the rim that sweeps a fitted hull is left out
        return np.array(geometry.points(), dtype=float)
    vertices = geometry.vertices() if callable(getattr(geometry, "vertices", None)) else None
    return None if vertices is None else np.array(vertices, dtype=float)


def _add_inertia(body: Element, inertia: Any) -> None:
    """Add mass, centre of mass and inertia, not below the floors."""
    values, axes = np.linalg.eigh(np.array(inertia.inertia))
    matrix = (axes * np.maximum(values, LEAST_INERTIA)) @ axes.T
    full = [matrix[0, 0], matrix[1, 1], matrix[2, 2], matrix[0, 1], matrix[0, 2], matrix[1, 2]]
    add(body, "inertial", pos=inertia.lever, mass=max(float(inertia.mass), LEAST_MASS), fullinertia=full)
