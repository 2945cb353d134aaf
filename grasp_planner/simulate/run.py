"""Simulate a grasp: gate, closing, rest, pushes and ladder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..checks import positive
from ..closing.path import ReferencePath, free_posture, reference_path
from ..grasp.grasp import Grasp
from ..grasp.squeeze import squeezed_forces
from ..spatial import Array
from .closing_hand import close_hand
from .engine import quiet_warnings
from .gate import GateReport, check_posture
from .lifting import lift, shake_all
from .protocol import PLAN, Protocol
from .result import DirectionReport, Frame, RestReport, Simulation, surface_limit
from .trials import DIRECTIONS, push_all
from .world import Snapshot, World

MEAN_S, MEAN_SAMPLES = 0.1, 10
"""Forces at rest are the mean of samples over the last part of the rest [s]."""
RECORDED_PUSH_S = 1.0
"""How much of each push is recorded [s]."""
FRAME_S = 1.0 / 30.0
"""Time between the frames of a recording [s]."""


def squeezed(grasp: Grasp, factor: float) -> Grasp:
    """Return a grasp with δσ, or the internal part of its forces, multiplied: the same contacts, more internal force.

    Its references follow the forces as well as the synergies can; with few synergies not exactly.
    """
    positive("squeeze", factor)
    if factor == 1.0:
        return grasp
    if grasp.contact_forces is not None:
        return replace(grasp, contact_forces=squeezed_forces(grasp, grasp.contact_forces, factor))
    return replace(grasp, delta_sigma=factor * grasp.delta_sigma)


def simulate_grasp(
    grasp: Grasp,
    protocol: Protocol = PLAN,
    *,
    squeeze: float = 1.0,
    ladder: bool = True,
    record: bool = False,
    progress: Callable[[str], None] | None = None,
    path: ReferencePath | None = None,
) -> Simulation:
    """Test a grasp in MuJoCo.

    The hand is moved by its n_s references and its joint springs 1/C_q alone, its palm fixed; the object is free.

    Args:
        grasp: The grasp.
        protocol: The test.
        squeeze: Factor on δσ.
        ladder: Whether to look for the load at failure in each direction.
        record: Whether to keep frames for an animation.
        progress: Called with what is being done.
        path: The references the hand closes by, of a grasp planned for other circumstances; the grasp's own if None.

    Returns:
        What was found; nothing is simulated if the posture overlaps too much, or what stands for the object is too far
        off it where it is touched.

    Raises:
        SimulationDependencyError: If MuJoCo is not installed.
        InvalidValueError: If the hand or the object can't be simulated.
    """
    tested = squeezed(grasp, squeeze)
    world = World(tested, protocol)
    say = progress or (lambda _: None)
    path = path or _path(tested, protocol)
    gates = _gates(tested, protocol, path)
    surface_error = world.surface_error()
    rest: RestReport | None = None
    directions: tuple[DirectionReport, ...] = ()
    frames = _Recorder(world, record)
    if all(gate.passed for gate in gates) and surface_error <= surface_limit(protocol):
        with quiet_warnings():
            say("closing")
            rest = _rest(world, path, frames)
            say("pushing")
            begin = world.save()
            directions = shake_all(world, begin) if protocol.table else push_all(world, begin, ladder=ladder)
            if record and not protocol.table:
                _record_pushes(world, begin, frames)
    return Simulation(
        grasp=tested,
        protocol=protocol,
        squeeze=squeeze,
        mass=world.scene.mass,
        friction=world.scene.friction,
        gates=gates,
        rest=rest,
        directions=directions,
        surface_error=surface_error,
        notes=world.scene.notes,
        frames=tuple(frames.frames),
    )


def _path(grasp: Grasp, protocol: Protocol) -> ReferencePath | None:
    """Return how the hand closes, None if it begins in the planned posture."""
    if protocol.start == "plan":
        return None
    return grasp.closing.path if protocol.geometry == "links" else reference_path(grasp, links=False)


class _Recorder:
    """Runs the simulation and keeps a frame now and then."""

    def __init__(self, world: World, record: bool) -> None:
        self.world, self.record = world, record
        self.frames: list[Frame] = []
        self._clock, self._next = 0.0, 0.0

    def run(self, duration: float) -> None:
        """Simulate for a time [s]."""
        count = max(1, round(duration / FRAME_S)) if self.record else 1
        for _ in range(count):
            self.world.run(duration / count)
            self._clock += duration / count
            if self._clock >= self._next - 1e-9:
                self.keep()

    def keep(self) -> None:
        """Keep the present instant."""
        if self.record:
            world, self._next = self.world, self._clock + FRAME_S
            self.frames.append(Frame(self._clock, world.independent_angles, world.object_pose))


def _record_pushes(world: World, begin: Snapshot, recorder: _Recorder) -> None:
    """Record one force push after the other, each from the rest."""
    for kind, _, axis, sign in DIRECTIONS:
        if kind == "force":
            world.restore(begin)
            wrench = np.zeros(6)
            wrench[axis] = sign * world.protocol.force
            world.push(wrench)
            recorder.run(RECORDED_PUSH_S)
            world.push(np.zeros(6))


def _gates(grasp: Grasp, protocol: Protocol, path: ReferencePath | None) -> tuple[GateReport, ...]:
    """Check the planned posture, and the open one if the hand starts there."""
    rules = (protocol.geometry, protocol.gate)
    gates = [check_posture(grasp, grasp.joint_angles, "planned", *rules, table=protocol.table)]
    if path is not None:
        q = free_posture(grasp, path.open)
        gates.append(check_posture(grasp, q, "open", *rules, table=protocol.table))
    return tuple(gates)


def _rest(world: World, path: ReferencePath | None, recorder: _Recorder) -> RestReport:
    """Close the hand if it starts open, let go of the object, wait, and look."""
    grasp, protocol = world.grasp, world.protocol
    if path is None:
        world.reset(grasp.joint_angles, grasp.sigma)
    else:
        close_hand(world, path, recorder.run)
    world.hold_lengths()
    world.hold_object(False)
    world.weigh(True)
    recorder.keep()
    if protocol.table:
        lift(world, recorder.run)
    if protocol.rest_s > 0.0:
        recorder.run(max(protocol.rest_s - MEAN_S, protocol.timestep))
    forces, others = _mean_forces(world)
    normals, predicted = grasp.contacts.normals, grasp.normal_forces
    along = np.einsum("ij,ij->i", forces, normals)
    across = np.linalg.norm(forces - along[:, None] * normals, axis=1)
    return RestReport(
        held=world.within_limits,
        displacement=world.displacement,
        rotation_deg=world.rotation_deg,
        forces=forces,
        normal_forces=along,
        other_force=float(np.linalg.norm(others)),
        predicted_normal_forces=np.array(predicted),
        friction_use=np.where(along > 1e-6, across / np.maximum(np.asarray(world.scene.friction) * along, 1e-9), 0.0),
    )


def _mean_forces(world: World) -> tuple[Array, Array]:
    """Return the mean contact forces over the last part of the rest; of the instant where there is no rest."""
    if world.protocol.rest_s == 0.0:
        return world.contact_forces()
    samples = []
    for _ in range(MEAN_SAMPLES):
        world.run(MEAN_S / MEAN_SAMPLES)
        samples.append(world.contact_forces())
    return np.mean([sample[0] for sample in samples], axis=0), np.mean([sample[1] for sample in samples], axis=0)
