"""Parameters of the model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from ..checks import finite_array
from ..exceptions import InvalidValueError
from ..hand.hand import Hand
from ..model.contact_model import CONTACT_MODELS, ContactModel, HardFinger, parse_contact_model
from ..spatial import Array, readonly
from ..values import Value
from .settings import check_settings, numbers_of_text, rows_of_text, setting, text_of_numbers, text_of_rows

STANDARD_GRAVITY = 9.81
"""Gravity [m/s²]."""
PAPER_WEIGHTS = {"force_weight": 1e-6, "task_weight": 1.0}
"""w_F [1/N] and w_C of the paper's tables."""


TorqueModel = Literal["total", "internal"]
ForceLaw = Literal["springs", "controllable"]


CLOSING_WEIGHT = 3.0
"""Weight of fingers that do not close along the surface normal where least force comes first and none is given: C
hardly grows by it, and fingers that close so arrive more often where the palm or the object is a little off."""


def _preference(what: str) -> float:
    """Return the setting of a small cost's weight."""
    weight: float = setting(0.0, f"Weight of {what}, as a share of C.", low=0.0, high=1e3, step=0.1)
    return weight


@dataclass(frozen=True, eq=False, repr=False)
class GraspParameters(Value):
    """Parameters of the model; the defaults are those of [Mavrogiannis2014] section IV (choice A3).

    Attributes:
        friction: Coefficient of friction μ, one number or one for each contact in the order of the set.
        contact_model: What a contact transmits: a hard finger as in the paper, a soft finger or only a normal force.
        structural_compliance: C_s [m/N]; the hand's own if None, as for the next two: a problem puts them in.
        joint_compliance: C_q [rad/(N m)], one number, one for each joint in the order of q, or the rows of a symmetric
            positive definite matrix.
        contact_stiffness: K_c [N/m].
        force_weight: w_F in z = w_F F + w_C C; eq. (29). If neither weight is given: least force first, then the
            best task; by (17), and with one of them given, the other is the paper's.
        task_weight: w_C.
        force_factor: Without weights, how many times the least F found the best task may take.
        least_share: Without weights, the share of the sum of normal forces that the search leaves to every finger.
        sharing_weight: How much uneven normal forces add to C, as a share of it; 0: nothing, like the next three.
        stop_weight: The same for joints near their stops.
        mean_weight: The same for distance from the synergies' mean posture.
        closing_weight: The same for fingers that do not press along the surface normal as they close; None:
            :data:`CLOSING_WEIGHT`, and with weights 0.
        gravity: Acceleration of gravity in O [m/s²], of shape (3,) (choice A4: along −z).
        torque_model: Which torque bends the joints in eq. (10): that of the ``total`` contact force, or of the
            ``internal`` forces only as in eq. (33) (choice A5). If None, total, or internal in the paper's problem.
        force_law: Which forces the hand may hold with: all that its ``springs`` and equilibrium allow, or only those
            that eq. (17) makes of δσ, the internal forces that the synergies can change (``controllable``). If None,
            springs, or (17) in the paper's problem.
    """

    friction: float | tuple[float, ...] = setting(
        0.8,
        "Coefficient of friction μ, one number or one for each contact as number,number,….",
        low=0.0,
        high=10.0,
        above=True,
        step=0.05,
        each_of="contact",
    )
    contact_model: ContactModel = setting(
        HardFinger,
        "What a contact transmits: hard, soft, soft:torsion=0.005 (metres) or frictionless.",
        read=parse_contact_model,
        write=lambda model: model.text,
    )
    structural_compliance: float = setting(
        None,
        "Compliance C_s of the structure.",
        kind="number",
        unit="m/N",
        low=0.0,
        high=1e3,
        above=True,
        none="the hand's",
    )
    joint_compliance: float | tuple[float, ...] | tuple[tuple[float, ...], ...] = setting(
        None,
        "Compliance C_q of the joints: one number, one for each joint as number,number,…, or rows with semicolons.",
        unit="rad/(N m)",
        low=0.0,
        high=1e3,
        none="the hand's",
        matrix=True,
        read=rows_of_text,
        write=text_of_rows,
        plain=float | list[float] | list[list[float]],
    )
    contact_stiffness: float = setting(
        None, "Stiffness K_c of a contact.", kind="number", unit="N/m", low=0.0, high=1e12, none="the hand's"
    )
    force_weight: float | None = setting(
        None,
        "Weight w_F of the grasping force F.",
        kind="number",
        unit="1/N",
        low=0.0,
        high=1e6,
        none="least force first; 1e-6 with --paper",
        paper=PAPER_WEIGHTS["force_weight"],
    )
    task_weight: float | None = setting(
        None,
        "Weight w_C of the task index C.",
        kind="number",
        low=0.0,
        high=1e6,
        none="least force first; 1 with --paper",
        paper=PAPER_WEIGHTS["task_weight"],
    )
    force_factor: float = setting(
        1.5, "Without weights, how many times the least F found the best task may take.", low=1.0, high=1e3, step=0.1
    )
    least_share: float = setting(
        0.05, "Without weights, share of the normal forces that every finger takes.", low=0.0, high=0.5, step=0.01
    )
    sharing_weight: float = _preference("normal forces that fingers do not share")
    stop_weight: float = _preference("joints near their stops")
    mean_weight: float = _preference("distance from the synergies' mean posture")
    closing_weight: float | None = setting(
        None,
        "Weight of fingers that do not close along the surface normal, as a share of C.",
        kind="number",
        low=0.0,
        high=1e3,
        step=0.1,
        none=f"{CLOSING_WEIGHT:g}; 0 with weights of F and C",
    )
    gravity: Array = setting(
        lambda: readonly([0.0, 0.0, -STANDARD_GRAVITY]),
        "Gravity x,y,z in the object frame.",
        unit="m/s²",
        low=-1e3,
        high=1e3,
        read=numbers_of_text,
        write=text_of_numbers,
        plain=tuple[float, float, float],
    )
    torque_model: TorqueModel | None = setting(
        None,
        "Torque that bends the soft joints: of the total contact force, or the internal one (eq. 33).",
        choices=("total", "internal"),
        none="total; internal with --paper",
        paper="internal",
    )
    force_law: ForceLaw = setting(
        None,
        "Forces a hand may hold with: all that its springs allow, or only those of eq. (17).",
        choices=("springs", "controllable"),
        none="springs; controllable with --paper",
        paper="controllable",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_settings(self)
        if not isinstance(self.contact_model, ContactModel):
            raise InvalidValueError("contact_model", self.contact_model, f"one of {', '.join(CONTACT_MODELS)}")
        if self.force_weight == self.task_weight == 0.0:
            raise InvalidValueError("force_weight, task_weight", (0.0, 0.0), "at least one of them > 0")
        if self.torque_model == "internal" and self.force_law == "springs":
            raise InvalidValueError("torque_model", "internal", "total where forces come from springs")
        object.__setattr__(self, "gravity", finite_array("gravity", self.gravity, (3,)))

    def of_hand(self, hand: Hand) -> GraspParameters:
        """Return the parameters with the hand's own numbers, a force law and its weights, where there are none.

        That law is springs, but where internal forces alone bend the joints, eq. (33): only (17) tells them apart.
        By (17), or where one weight is given, weights that are missing are the paper's.
        """
        usual = self._usual(hand)
        if self.weighted or (self.force_law or usual["force_law"]) == "controllable":
            usual |= PAPER_WEIGHTS
        missing = {name: value for name, value in usual.items() if getattr(self, name) is None}
        return replace(self, **missing) if missing else self

    def of_paper(self) -> GraspParameters:
        """Return the parameters with the paper's force law (17), torque (33) and weights, where they have none."""
        law = self.force_law or "controllable"
        usual: dict[str, Any] = PAPER_WEIGHTS | {
            "force_law": law,
            "torque_model": "internal" if law == "controllable" else "total",
        }
        missing = {name: value for name, value in usual.items() if getattr(self, name) is None}
        return replace(self, **missing) if missing else self

    def without_hand(self, hand: Hand) -> GraspParameters:
        """Return the parameters without those that :meth:`of_hand` gives, so that another hand can give its own."""
        own = {name: None for name, value in self._usual(hand).items() if getattr(self, name) == value}
        return replace(self, **own)  # type: ignore[arg-type]  # None: given by a hand later on

    def _usual(self, hand: Hand) -> dict[str, Any]:
        """Return what stands where nothing is given."""
        law = "controllable" if self.torque_model == "internal" else "springs"
        return hand_parameters(hand) | {"torque_model": "total", "force_law": law}

    @property
    def closing_preference(self) -> float:
        """The weight of fingers that do not close along the surface normal, given or not."""
        if self.closing_weight is not None:
            return self.closing_weight
        return 0.0 if self.weighted else CLOSING_WEIGHT

    @property
    def weighted(self) -> bool:
        """Whether the objective is the weighted sum (29); else it is least force first, then the best task."""
        return self.force_weight is not None or self.task_weight is not None


def hand_parameters(hand: Hand) -> dict[str, Any]:
    """Return the hand's own compliances [m/N, rad/(N m)] and contact stiffness [N/m], by the name of the parameter."""
    joints = plain_compliance(hand.joint_compliance)
    described = hand.description.compliance
    return {
        "structural_compliance": described.structural,
        "joint_compliance": joints[0] if len(set(joints)) == 1 else joints,
        "contact_stiffness": described.contact_stiffness,
    }


def plain_compliance(compliance: Array) -> tuple[Any, ...]:
    """Return C_q, a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q), as the parameter has it."""
    return tuple(tuple(row) if isinstance(row, list) else row for row in compliance.tolist())
