"""What a simulated test does: loads, times, limits, and the numbers of the simulator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ..checks import finite_array, positive
from ..exceptions import InvalidValueError, NameNotFoundError

Start = Literal["plan", "open"]
Geometry = Literal["links", "contacts"]


MOST_NOSLIP = 1000
"""Most iterations of the no-slip solver."""


@dataclass(frozen=True)
class Protocol:
    """A test of a grasp in simulation.

    Attributes:
        name: Its name.
        start: ``plan``: the hand starts in the planned posture, its references set. ``open``: it starts open and
            closes by moving its references.
        hold_while_closing: Whether the object is held in place until the hand has closed.
        carried: Stiffness to ways [N/m] and to turns [N m/rad] with which a giver carries the object until the hand has
            closed, damped critically; None if nobody does.
        firmness: How many times the planned efforts the motors squeeze with after closing; 1 for the planned
            references as they are.
        gravity: Whether the plan's gravity acts on the object; around a free object the hand closes without it,
            unless it stands on a table.
        table: Whether the object stands on a table while the hand closes, is then lifted and shaken, not pushed.
        lift: How far it is lifted [m].
        lift_s: How long that takes [s].
        shake: Largest acceleration of the palm when it shakes along x, y and z of O, one after the other [m/s²].
        shake_hz: How often it goes to and fro [1/s].
        shake_s: How long it shakes along each axis [s].
        joint_friction: Dry friction of every independent joint [N m].
        mass: Mass of the object [kg]; the plan's if None.
        friction: Coefficient of friction; the plan's, of every contact its own, if None.
        torsional_friction: Torsional friction [m]: most torque over normal force; the plan's, μ γ, if None.
        force: Force pushed with in each direction [N].
        torque_arm: The torques tested are force · arm [m]; the object's length scale if None.
        hold_s: How long each push lasts [s].
        check_s: How often the object is looked at [s].
        torques: Whether torques are tested too; they are reported beside the forces and do not decide.
        ladder_cap: Largest force of the ladder [N]; its torques go up to this times the arm.
        ladder_accuracy: Relative accuracy of the load at failure.
        max_displacement: Limit of the object's way from its planned pose [m].
        max_rotation_deg: Limit of its rotation [degrees].
        stage_s: How long the hand takes from open to touching [s].
        grip_s: How long from touching to the planned references [s].
        rest_s: Time to come to rest after closing and release [s].
        gate: Deepest overlap at the planned and at the open posture [m]; more, and nothing is simulated.
        geometry: What of the hand collides: all ``links``, or the ``contacts`` only (for plans without clearance).
        timestep: Step of the simulator [s].
        solref: MuJoCo's time constant and damping ratio of hand contacts.
        solimp: MuJoCo's impedance of hand contacts.
        impratio: MuJoCo's ratio of frictional to normal impedance.
        noslip_iterations: Iterations of MuJoCo's no-slip solver.
    """

    name: str
    start: Start = "plan"
    hold_while_closing: bool = True
    carried: tuple[float, float] | None = None
    firmness: float = 1.0
    gravity: bool = True
    table: bool = False
    lift: float = 0.1
    lift_s: float = 1.0
    shake: float = 5.0
    shake_hz: float = 3.0
    shake_s: float = 1.5
    joint_friction: float = 0.0
    mass: float | None = None
    friction: float | None = None
    torsional_friction: float | None = None
    force: float = 1.0
    torque_arm: float | None = None
    hold_s: float = 2.0
    check_s: float = 0.2
    torques: bool = True
    ladder_cap: float = 64.0
    ladder_accuracy: float = 0.05
    max_displacement: float = 0.05
    max_rotation_deg: float = 15.0
    stage_s: float = 0.4
    grip_s: float = 0.4
    rest_s: float = 1.0
    gate: float = 1e-3
    geometry: Geometry = "links"
    timestep: float = 0.001
    solref: tuple[float, float] = (0.003, 1.0)
    solimp: tuple[float, float, float] = (0.999, 0.999, 0.001)
    impratio: float = 1000.0
    noslip_iterations: int = 0

    def __post_init__(self) -> None:
        for name in ("force", "hold_s", "check_s", "max_displacement", "max_rotation_deg", "stage_s", "grip_s"):
            positive(f"protocol {name}", getattr(self, name))
        for name in ("ladder_cap", "firmness", "lift", "lift_s", "shake", "shake_hz", "shake_s"):
            positive(f"protocol {name}", getattr(self, name))
        if not 1e-3 <= positive("protocol ladder_accuracy", self.ladder_accuracy) <= 1.0:
            raise InvalidValueError("protocol ladder_accuracy", self.ladder_accuracy, "from 0.001 to 1")
        for name in ("mass", "friction", "torque_arm"):
            if getattr(self, name) is not None:
                positive(f"protocol {name}", getattr(self, name))
        for name in ("torsional_friction", "rest_s", "gate", "joint_friction"):
            if name != "torsional_friction" or self.torsional_friction is not None:
                positive(f"protocol {name}", getattr(self, name), zero_allowed=True)
        for name, allowed in (("start", ("plan", "open")), ("geometry", ("links", "contacts"))):
            if getattr(self, name) not in allowed:
                raise NameNotFoundError(f"protocol {name}", str(getattr(self, name)), allowed)
        if self.firmness < 1.0:
            raise InvalidValueError("protocol firmness", self.firmness, "1 or more")
        if not 1e-5 <= positive("protocol timestep", self.timestep) <= 0.004:
            raise InvalidValueError("protocol timestep", self.timestep, "from 1e-5 to 0.004 s")
        self._check_solver()

    def _check_solver(self) -> None:
        """Check the name, what is switched on, and what MuJoCo's solver is told."""
        if not isinstance(self.name, str):
            raise InvalidValueError("protocol name", self.name, "a text")
        for name in ("hold_while_closing", "gravity", "torques", "table"):
            if not isinstance(getattr(self, name), bool):
                raise InvalidValueError(f"protocol {name}", getattr(self, name), "true or false")
        if self.table and (self.start != "open" or not self.gravity or self.hold_while_closing):
            raise InvalidValueError("protocol table", True, "with start open, gravity, and an object that is not held")
        if self.carried is not None:
            if self.hold_while_closing or self.table or self.start != "open":
                raise InvalidValueError("protocol carried", self.carried, "with start open, and an object not held")
            for value in finite_array("protocol carried", self.carried, (2,)):
                positive("protocol carried", value)
        positive("protocol impratio", self.impratio)
        for name, size in (("solref", 2), ("solimp", 3)):
            for value in finite_array(f"protocol {name}", getattr(self, name), (size,)):
                positive(f"protocol {name}", value)
        count = self.noslip_iterations
        if type(count) is not int or not 0 <= count <= MOST_NOSLIP:
            raise InvalidValueError("protocol noslip_iterations", count, f"a whole number from 0 to {MOST_NOSLIP}")

    @property
    def check_times(self) -> np.ndarray:
        """When the object is looked at during a push [s]."""
        count = max(1, round(self.hold_s / self.check_s))
        return self.hold_s / count * np.arange(1, count + 1)


PLAN = Protocol("plan")
"""The plan as it is: its own mass, contacts and gravity, from the planned posture; 1 N pushes."""

DEXGRASPBENCH = Protocol(
    "dexgraspbench",
    start="open",
    hold_while_closing=False,
    gravity=False,
    mass=0.1,
    friction=0.6,
    torsional_friction=0.02,
    rest_s=0.0,
    timestep=0.004,
    # Mean of the benchmark's hand (0.005, 1; 0.5, 0.99, 0.0001) and object (MuJoCo's defaults), as MuJoCo mixes them.
    solref=(0.0125, 1.0),
    solimp=(0.7, 0.97, 0.00055),
    impratio=10.0,
    noslip_iterations=2,
)
"""The force-closure test of DexGraspBench: 100 g, μ 0.6, no gravity, 1 N along ±x, ±y, ±z for 2 s; 5 cm, 15°."""

FREE = replace(PLAN, name="free", start="open", hold_while_closing=False, stage_s=1.0, grip_s=0.06, firmness=2.0)
"""The plan's own numbers, the hand closing around an object that nothing holds: approach, quick grip, firm squeeze."""

PROTOCOLS = {
    "plan": PLAN,
    "closing": replace(PLAN, name="closing", start="open"),
    "free": FREE,
    "handed": replace(FREE, name="handed", carried=(300.0, 0.3)),
    "table": replace(FREE, name="table", table=True),
    "dexgraspbench": DEXGRASPBENCH,
    "dexgraspbench-hard": replace(DEXGRASPBENCH, name="dexgraspbench-hard", friction=0.3, torsional_friction=0.002),
}
"""Protocols by name."""


def error_protocol(name: str) -> str:
    """Return the protocol that is tried with errors beside one: handed over or on a table as there, otherwise free."""
    return name if name in ("handed", "table") else "free"


def find_protocol(name: str, firmness: float | None = None) -> Protocol:
    """Return a protocol by its name.

    Args:
        name: Its name.
        firmness: Firmness in place of its own, if given.

    Raises:
        InvalidValueError: If the firmness is out of range.
        NameNotFoundError: If there is none; lists those that exist.
    """
    if name not in PROTOCOLS:
        raise NameNotFoundError("protocol", name, PROTOCOLS)
    return PROTOCOLS[name] if firmness is None else replace(PROTOCOLS[name], firmness=firmness)


def protocol_from(fields: dict[str, Any]) -> Protocol:
    """Return a protocol from its fields as JSON gives them, lists for tuples.

    Raises:
        InvalidValueError: If a field does not exist or is out of range.
    """
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()
    }
    known = Protocol.__dataclass_fields__
    for name in values:
        if name not in known:
            raise NameNotFoundError("protocol field", name, known)
    return Protocol(**values)
