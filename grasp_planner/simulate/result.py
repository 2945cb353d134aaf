"""What a simulation found, as plain frozen values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..grasp.grasp import Grasp
from ..spatial import Array
from .gate import GateReport
from .protocol import Protocol

MOST_SURFACE_ERROR = 2e-3
"""How far the simulated surface may be from the planned contacts; farther off, it is another object [m]."""


def surface_limit(protocol: Protocol) -> float:
    """Return how far the simulated surface may be from the contacts [m]: a hand off the plan does not get to them."""
    return max(MOST_SURFACE_ERROR, protocol.gate)


@dataclass(frozen=True)
class RestReport:
    """Object and forces after closing and release, before any push.

    Attributes:
        held: Whether the object is still within the limits.
        displacement: Of the object from its planned position [m].
        rotation_deg: From its planned orientation [degrees].
        forces: Of the fingertips on the object, mean of the last tenth of a second [N], of shape (n_c, 3).
        normal_forces: Along the planned normals [N], of shape (n_c,).
        other_force: Size of the force of everything else of the hand [N].
        predicted_normal_forces: Of the plan [N], of shape (n_c,).
        friction_use: |f_t| / (μ f_n) of every fingertip, 1 where it slides; 0 where it does not touch, of shape (n_c,).
    """

    held: bool
    displacement: float
    rotation_deg: float
    forces: Array
    normal_forces: Array
    other_force: float
    predicted_normal_forces: Array
    friction_use: Array

    @property
    def normal_force_error(self) -> float:
        """Norm of the difference of simulated and predicted normal forces, relative to F of the plan."""
        difference = np.linalg.norm(self.normal_forces - self.predicted_normal_forces)
        return float(difference / max(float(np.linalg.norm(self.predicted_normal_forces)), 1e-12))


@dataclass(frozen=True)
class DirectionReport:
    """One push.

    Attributes:
        kind: ``force``, ``torque``, or ``shake`` of an object that was lifted.
        direction: Such as ``+x``, in O.
        load: How strong it was [N, N m or m/s²].
        held: Whether the object stayed within the limits all the time.
        displacement: Largest one seen [m].
        rotation_deg: Largest one seen [degrees].
        load_held: Largest load of the ladder that was held [N or N m]; None without a ladder.
        load_lost: Smallest load of the ladder that was not; None without a ladder or where all were held.
    """

    kind: str
    direction: str
    load: float
    held: bool
    displacement: float
    rotation_deg: float
    load_held: float | None = None
    load_lost: float | None = None


@dataclass(frozen=True)
class Frame:
    """An instant of a recording.

    Attributes:
        time: Time [s].
        joint_angles: Independent joint angles [rad], of shape (n_q,).
        object_pose: Position [m] and quaternion (w, x, y, z) of the object in its planned frame, of shape (7,).
    """

    time: float
    joint_angles: Array
    object_pose: Array


@dataclass(frozen=True)
class Simulation:
    """The result of a simulated test.

    Attributes:
        grasp: The grasp that was tested, with the squeeze it was tested with.
        protocol: The test.
        squeeze: Factor on the plan's δσ.
        mass: Mass of the object [kg].
        friction: Coefficient of friction, one number or one for each contact.
        gates: Overlaps at the postures that were checked; if one is too deep, nothing was simulated.
        rest: At rest; None if nothing was simulated: a gate was not passed, or the surface is too far off.
        directions: All pushes; empty if nothing was simulated.
        surface_error: Largest distance between a planned contact and the simulated object's surface [m].
        notes: What is not exactly as planned.
        frames: The recording, if one was asked for.
    """

    grasp: Grasp
    protocol: Protocol
    squeeze: float
    mass: float
    friction: float | tuple[float, ...]
    gates: tuple[GateReport, ...]
    rest: RestReport | None
    directions: tuple[DirectionReport, ...]
    surface_error: float
    notes: tuple[str, ...]
    frames: tuple[Frame, ...] = ()

    @property
    def gate_passed(self) -> bool:
        """Whether all gates were passed."""
        return all(gate.passed for gate in self.gates)

    @property
    def is_another_object(self) -> bool:
        """Whether what stands for the object is so far off it that nothing was simulated, nor says anything of it."""
        return self.surface_error > surface_limit(self.protocol)

    @property
    def forces_held(self) -> int:
        """How many of the six force directions were held."""
        return sum(report.held for report in self.directions if report.kind == "force")

    @property
    def torques_held(self) -> int:
        """How many of the six torque directions were held."""
        return sum(report.held for report in self.directions if report.kind == "torque")

    @property
    def deciding(self) -> tuple[DirectionReport, ...]:
        """The pushes, or shakes of a lifted object, that decide; torques do not."""
        return tuple(report for report in self.directions if report.kind != "torque")

    @property
    def passed(self) -> bool:
        """Whether the gates were passed, the object rested within the limits, and all forces or shakes were held."""
        held = bool(self.deciding) and all(report.held for report in self.deciding)
        return self.gate_passed and self.rest is not None and self.rest.held and held

    def weakest(self, kind: str) -> float | None:
        """Return the least load of the ladder that was held [N or N m] over all directions of a kind; None without."""
        loads = [report.load_held for report in self.directions if report.kind == kind]
        known = [load for load in loads if load is not None]
        return min(known) if known else None

    @property
    def verdict(self) -> str:
        """One sentence."""
        for gate in self.gates:
            if not gate.table_overlap <= gate.limit:
                deep = f"{1e3 * gate.table_overlap:.1f} mm in the {gate.posture} posture"
                return f"not simulated: the hand would go through the table by {deep}"
            if not gate.passed:
                what, depth = "the hand overlaps the object", gate.object_overlap
                if gate.self_overlap > gate.object_overlap:
                    what, depth = "links overlap each other", gate.self_overlap
                return (
                    f"refused: {what} by {1e3 * depth:.1f} mm in the {gate.posture} posture "
                    f"(at most {1e3 * gate.limit:.1f} mm)"
                )
        if self.is_another_object:
            off = f"{1e3 * self.surface_error:.1f} mm off the planned contacts"
            most = f"at most {1e3 * surface_limit(self.protocol):g} mm"
            return f"not simulated: what stands for the object is {off} ({most})"
        assert self.rest is not None
        if not self.rest.held:
            lifted = "while it is lifted from its table" if self.protocol.table else "before any push"
            return f"failed: the object is lost {lifted}"
        if self.protocol.table:
            held = sum(report.held for report in self.deciding)
            count = f"lifted {100 * self.protocol.lift:g} cm, {held} of 3 shakes of {self.protocol.shake:g} m/s² held"
            return f"passed: {count}" if self.passed else f"failed: {count}"
        count = f"{self.forces_held} of 6 force directions held at {self.protocol.force:g} N"
        return f"passed: {count}" if self.passed else f"failed: {count}"
