"""A running simulation: references in, object pose and contact forces out."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..spatial import Array
from .engine import load_mujoco
from .motors import HeldMotors
from .protocol import Protocol
from .scene import Scene, build_scene
from .tips import COMPRESSION, ROUNDING

MAKE_WAY_S, OVERLAP = 0.2, 1e-4
"""How long an object makes way for a hand that overlaps it [s], and what overlap counts [m]."""


@dataclass(frozen=True)
class Snapshot:
    """Everything the simulator needs to go on from an instant.

    Attributes:
        state: MuJoCo's integration state.
        controls: The references σ [rad], of shape (n_s,).
    """

    state: Array
    controls: Array


class World:
    """MuJoCo's model and data of one grasp; for one thread.

    Args:
        grasp: The grasp.
        protocol: The test.
    """

    def __init__(self, grasp: Grasp, protocol: Protocol) -> None:
        self.grasp, self.protocol = grasp, protocol
        self.scene: Scene = build_scene(grasp, protocol)
        self._mujoco = mujoco = load_mujoco()
        try:
            self.model = mujoco.MjModel.from_xml_string(self.scene.xml)
        except ValueError as error:
            reason = str(error).strip().splitlines()[0]
            scene = f"{grasp.problem.hand.name}, {grasp.problem.grasp_object.text}"
            raise InvalidValueError("scene", scene, f"what MuJoCo can build ({reason})") from None
        self.data = mujoco.MjData(self.model)
        model, hand = self.model, grasp.problem.hand
        names = tuple(hand.model.names)[1:]
        joints = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in names]
        self._hand_qpos = np.array([model.jnt_qposadr[joint] for joint in joints])
        free = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, "object_free")
        start = int(model.jnt_qposadr[free])
        self._object_qpos = slice(start, start + 7)
        self._object = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "object")
        geom = mujoco.mjtObj.mjOBJ_GEOM
        self._tips = {mujoco.mj_name2id(model, geom, name): k for k, name in enumerate(self.scene.tip_names)}
        self._solids = {mujoco.mj_name2id(model, geom, name) for name in self.scene.object_names}
        table = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "table")
        self._table, self._table_body = (None if table < 0 else int(model.body_mocapid[table])), table
        self._hold = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_EQUALITY, "hold")
        self._motors = HeldMotors(grasp.problem, model)
        self._free = int(model.jnt_dofadr[free])
        self._carried: tuple[float, float] | None = None

    def reset(self, q: Array, sigma: Array) -> None:
        """Put hand and object at rest: posture q [rad] of shape (n_q,), references σ [rad], object as planned."""
        self._mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self._hand_qpos] = self.grasp.problem.hand.full_configuration(q)
        self.data.ctrl[:] = sigma
        self._mujoco.mj_forward(self.model, self.data)

    def surface_error(self) -> float:
        """Return how far the simulated object's surface is from the fingertips at the plan, beyond the planned gap [m].

        Moves the hand to the plan.
        """
        self.reset(self.grasp.joint_angles, self.grasp.sigma)
        far, worst = 0.1, 0.0
        for tip, gap in zip(self._tips, self.grasp.contacts.gaps, strict=True):
            distance = min(self._mujoco.mj_geomDistance(self.model, self.data, tip, s, far, None) for s in self._solids)
            planned = 0.0 if abs(gap) < ROUNDING else float(gap)
            worst = max(worst, abs(distance + COMPRESSION - planned))
        return worst

    def set_references(self, sigma: Array) -> None:
        """Set the references σ [rad], of shape (n_s,)."""
        self.data.ctrl[:] = sigma

    def hold_lengths(self) -> None:
        """Let motors that hold the lengths of their tendons do so from now on; others keep their tensions."""
        self._motors.hold(self.data)

    def hold_object(self, held: bool) -> None:
        """Fix the object at its planned pose, or let it go."""
        self.data.eq_active[self._hold] = held

    def carry_object(self, carried: tuple[float, float] | None) -> None:
        """Have a giver carry the object softly about its planned pose, or let it go.

        Args:
            carried: Stiffness to ways [N/m] and turns [N m/rad], damped critically; None to let go.
        """
        damping, where = self.model.dof_damping, slice(self._free, self._free + 6)
        damping[where], self.data.xfrc_applied[self._object], self._carried = 0.0, 0.0, carried
        if carried is not None:
            inertia = np.repeat([self.model.body_mass[self._object], self.model.body_inertia[self._object].mean()], 3)
            damping[where] = 2.0 * np.sqrt(np.repeat(carried, 3) * inertia)

    def make_way(self) -> None:
        """Let a hand that overlaps the free object where it begins push it aside as slowly as it would have come."""
        where = slice(self._free, self._free + 6)
        if not any(self._is_deep(index) for index in range(self.data.ncon)):
            return
        for _ in range(round(MAKE_WAY_S / self.protocol.timestep)):
            self.run(self.protocol.timestep)
            self.data.qvel[where] = 0.0

    def _is_deep(self, index: int) -> bool:
        """Return whether the hand reaches into the object at a contact."""
        contact = self.data.contact[index]
        bodies = [int(self.model.geom_bodyid[geom]) for geom in contact.geom]
        others = [body for body in bodies if body != self._object]
        return len(others) == 1 and others[0] != self._table_body and bool(contact.dist < -OVERLAP)

    def weigh(self, weighs: bool) -> None:
        """Let gravity act, or not."""
        protocol = self.protocol
        gravity = self.grasp.problem.parameters.gravity if weighs and protocol.gravity else np.zeros(3)
        self.model.opt.gravity[:] = gravity

    def watch(self, spans: Iterable[float]) -> tuple[bool, float, float]:
        """Let time pass in spans [s] until the object is beyond the limits.

        Returns:
            Whether it stayed within them, its largest displacement [m], and its largest rotation [degrees].
        """
        held, far, turned = self.within_limits, self.displacement, self.rotation_deg
        for span in spans:
            self.run(span)
            far, turned = max(far, self.displacement), max(turned, self.rotation_deg)
            held = held and self.within_limits
            if not held:
                break
        return held, far, turned

    def lower_table(self, way: float) -> None:
        """Put the table so far below where the object stood on it [m]."""
        assert self._table is not None
        up = self.grasp.problem.up
        self.data.mocap_pos[self._table] = -(self.scene.table_depth + way) * up

    def accelerate(self, acceleration: Array) -> None:
        """Let object and links feel that the palm accelerates [m/s²], until changed; in place of pushes."""
        self.data.xfrc_applied[:, :3] = -self.model.body_mass[:, None] * acceleration

    def push(self, wrench: Array) -> None:
        """Apply a wrench to the object at its centre of mass, in world axes [N, N m], until changed."""
        self.data.xfrc_applied[self._object] = wrench

    def run(self, duration: float) -> None:
        """Simulate for a time [s]."""
        steps = max(1, round(duration / self.protocol.timestep))
        if self._carried is None:
            self._mujoco.mj_step(self.model, self.data, steps)
        else:
            for _ in range(steps):
                self.data.xfrc_applied[self._object] = self._giver_wrench(*self._carried)
                self._mujoco.mj_step(self.model, self.data)
        self._motors.give_way(self.data)

    def _giver_wrench(self, way: float, turn: float) -> Array:
        """Return what the springs of a giver do to the object, in world axes [N, N m]; small turns, of shape (6,)."""
        pose = self.object_pose
        angles = 2.0 * math.copysign(1.0, float(pose[3])) * pose[4:]
        return np.concatenate([-way * pose[:3], -turn * angles])

    def save(self) -> Snapshot:
        """Return the present instant."""
        spec = self._mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(self._mujoco.mj_stateSize(self.model, spec))
        self._mujoco.mj_getState(self.model, self.data, state, spec)
        return Snapshot(state, np.array(self.data.ctrl))

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to an instant."""
        self._mujoco.mj_setState(self.model, self.data, snapshot.state, self._mujoco.mjtState.mjSTATE_INTEGRATION)
        self.data.ctrl[:] = snapshot.controls
        self._mujoco.mj_forward(self.model, self.data)

    @property
    def object_pose(self) -> Array:
        """Position [m] and quaternion (w, x, y, z) of the object in its planned frame, of shape (7,)."""
        return np.array(self.data.qpos[self._object_qpos])

    @property
    def displacement(self) -> float:
        """Distance of the object from its planned position [m]."""
        return float(np.linalg.norm(self.object_pose[:3]))

    @property
    def rotation_deg(self) -> float:
        """Angle of the object from its planned orientation [degrees]."""
        quaternion = self.object_pose[3:]
        return math.degrees(2.0 * math.atan2(float(np.linalg.norm(quaternion[1:])), abs(float(quaternion[0]))))

    @property
    def within_limits(self) -> bool:
        """Whether the object is where the protocol wants it."""
        protocol = self.protocol
        near = self.displacement < protocol.max_displacement and self.rotation_deg < protocol.max_rotation_deg
        return bool(near and np.isfinite(self.data.qpos).all())

    @property
    def references(self) -> Array:
        """The references σ [rad], of shape (n_s,)."""
        return np.array(self.data.ctrl)

    @property
    def time(self) -> float:
        """Time of the simulation [s]."""
        return float(self.data.time)

    @property
    def independent_angles(self) -> Array:
        """Angles of the independent joints [rad], of shape (n_q,)."""
        names = list(self.grasp.problem.hand.model.names)[1:]
        return self.joint_angles[[names.index(name) for name in self.grasp.problem.hand.joint_names]]

    @property
    def joint_angles(self) -> Array:
        """Angles of all URDF joints [rad], of shape (nv,)."""
        return np.array(self.data.qpos[self._hand_qpos])

    def contact_forces(self) -> tuple[Array, Array]:
        """Return the forces of the hand on the object, in world axes [N].

        Returns:
            Forces of the fingertips, of shape (n_c, 3), and of everything else of the hand together, of shape (3,).
        """
        forces, others, wrench = np.zeros((len(self._tips), 3)), np.zeros(3), np.zeros(6)
        for index in range(self.data.ncon):
            contact = self.data.contact[index]
            first, second = int(contact.geom[0]), int(contact.geom[1])
            if (first in self._solids) == (second in self._solids):
                continue
            self._mujoco.mj_contactForce(self.model, self.data, index, wrench)
            # The force acts on the second geometry, along the first to the second.
            force = np.array(contact.frame).reshape(3, 3).T @ wrench[:3]
            if first in self._solids:
                first, force = second, -force
            if first in self._tips:
                forces[self._tips[first]] += force
            else:
                others += force
        return forces, others
