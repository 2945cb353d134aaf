"""The headline of simulation: a hand closes from open around an object, everything a little off; what survives.

The hand goes through the references that were planned; palm, size, friction, mass and joints are other than planned.
Last the object stands on its table instead, is lifted and shaken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..analysis.off_plan import Errors, off_plan
from ..checks import positive_whole
from ..closing.path import ReferencePath
from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from .protocol import PROTOCOLS, Protocol
from .run import simulate_grasp
from .table import table_height

GATE = 0.02
"""Deepest overlap with which a simulation off the plan still begins [m]: the planned posture is then not reached."""
ERRORS = {
    "as planned": Errors(),
    "palm 2 mm, 2°": Errors(palm=2e-3, turn_deg=2.0),
    "radius ± 1 mm": Errors(radius=1e-3),
    "μ × 0.75": Errors(friction=0.75),
    "mass × 1.5": Errors(mass=1.5),
    "joint friction 10 N mm": Errors(joint_friction=0.01),
    "all at once": Errors(2e-3, 2.0, 1e-3, 0.75, 1.5, 0.01),
}
"""The rows of the table, the object free."""
TABLE = f"table, lifted {100 * PROTOCOLS['table'].lift:g} cm, shaken"
"""The last row: as planned, the object on its table."""
ROWS = (*ERRORS, TABLE)
"""Names of all rows."""


@dataclass(frozen=True)
class Survival:
    """A row of the table.

    Attributes:
        name: What was off.
        survived: Simulations in which the hand closed and all pushes were held, or the object was lifted and shaken.
        tried: Simulations; none where the object can't be simulated as it is, and on a table of which the plan says
            nothing and through which the hand would go.
        worst: What the first simulation that failed says, or why there is none; empty if none failed.
    """

    name: str
    survived: int
    tried: int
    worst: str


def survival(
    grasp: Grasp, *, seed: int = 0, samples: int = 4, protocol: Protocol = PROTOCOLS["free"]
) -> tuple[Survival, ...]:
    """Close a hand around an object, with errors of each kind and with all at once, and around one on its table.

    Args:
        grasp: The grasp.
        seed: Seed of the random errors.
        samples: Simulations of every row whose errors are random; of the others there is one.
        protocol: How the hand closes, from open; on a table the object is lifted and shaken in every row, as in the
            last one whatever the protocol says.

    Returns:
        The rows.

    Raises:
        SimulationDependencyError: If MuJoCo is not installed.
        InvalidValueError: If hand or object can't be simulated, or the protocol does not close a hand.
    """
    positive_whole("samples", samples)
    if protocol.start != "open":
        raise InvalidValueError("protocol", protocol.name, "one that closes from open")
    rng, rows = np.random.default_rng(seed), []
    for name, errors in ERRORS.items():
        count, survived, worst = samples if errors.random else 1, 0, ""
        for sample in range(count):
            found = simulate_grasp(
                off_plan(grasp, errors, 1.0 if (seed + sample) % 2 == 0 else -1.0, rng),
                _protocol(grasp, errors, protocol),
                ladder=False,
                path=grasp.closing.path,
            )
            survived += found.passed
            worst = worst or ("" if found.passed else found.verdict)
            if found.is_another_object and found.gate_passed and not errors.random:
                return tuple(Survival(each, 0, 0, found.verdict) for each in ROWS)
        rows.append(Survival(name, survived, count, worst))
    return *rows, _from_table(grasp)


def simulated_loss(grasp: Grasp, path: ReferencePath) -> str | None:
    """Return why a hand that closes around the free object loses it in simulation; None if it holds six pushes.

    Judges for :func:`grasp_planner.analysis.closing_tolerances`.

    Args:
        grasp: The grasp, its palm or its object off the plan.
        path: The references that were planned.
    """
    protocol = replace(PROTOCOLS["free"], gate=GATE, torques=False, force=grasp.problem.loads.force or 1.0)
    found = simulate_grasp(grasp, protocol, ladder=False, path=path)
    return None if found.passed else found.verdict.partition(": ")[2]


def _from_table(grasp: Grasp) -> Survival:
    """Close the hand around the object on its table, lift it and shake it."""
    try:
        table_height(grasp.problem)
    except InvalidValueError:
        return Survival(TABLE, 0, 0, "not simulated: the object does not stand under the plan's gravity")
    found = simulate_grasp(grasp, PROTOCOLS["table"], path=grasp.closing.path)
    # Who planned with a table answers for the hand that goes through it; who did not, was not asked.
    tried = found.rest is not None or grasp.problem.clearance.ground is not None
    return Survival(TABLE, int(found.passed), int(tried), "" if found.passed else found.verdict)


def _protocol(grasp: Grasp, errors: Errors, protocol: Protocol) -> Protocol:
    """Return a protocol with friction, mass and joints off the plan."""
    return replace(
        protocol,
        friction=None if errors.friction == 1.0 else errors.friction * float(grasp.problem.friction.min()),
        mass=errors.mass * grasp.problem.grasp_object.mass,
        joint_friction=errors.joint_friction,
        gate=protocol.gate if errors == Errors() else GATE,
        torques=False,
    )
