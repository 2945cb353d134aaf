"""The layout of the JSON form of a grasp: plain numbers, SI units, nothing unknown, nothing infinite."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from ..problem.clearance_options import ClearanceOptions
from ..problem.load_cases import LoadCases
from ..problem.parameters import GraspParameters
from ..problem.search_options import PlannerOptions
from .hand_record import HandSourceRecord
from .old_violations import current_violations
from .settings import settings_layout

Number = Annotated[float, Field(allow_inf_nan=False)]
Optional = Number | None
Vector3 = tuple[Number, Number, Number]
Vector6 = tuple[Number, Number, Number, Number, Number, Number]


class Record(BaseModel):
    """Frozen record that refuses unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class TaskRecord(Record):
    """One task direction and how well the grasp transmits it."""

    text: str = Field(description="text form, for instance force:0,1,0")
    kind: Literal["force", "torque", "twist"]
    direction: Vector6 = Field(description="unit direction in O, linear part first")
    weight: Number
    transmission_ratio: Optional = Field(description="α or β; null where infinite")
    alignment_angle_deg: Optional = Field(description="angle to the ellipsoid's longest axis; null if undefined")
    alignment_degenerate: bool


class PoseRecord(Record):
    """A pose in O."""

    position: Vector3 = Field(description="m")
    quaternion_xyzw: tuple[Number, Number, Number, Number]
    rotation: tuple[Vector3, Vector3, Vector3] | None = Field(
        default=None, description="the same rotation as a matrix, row by row, to the last digit"
    )


class SynergySpaceRecord(Record):
    """Synergies that are none of the hand's sets."""

    joint_names: list[str]
    mean: list[Number] = Field(description="mean posture, rad")
    basis: list[list[Number]] = Field(description="synergy matrix, row by row, of unit columns")
    variance: list[Number] | None = Field(description="along each synergy, rad²; null if not known")
    name: str
    provenance: str


class ContactRecord(Record):
    """One contact, in O."""

    name: str
    link: str
    frame: str
    radius: Number = Field(description="fingertip radius, m")
    point: Vector3 = Field(description="m")
    normal: Vector3 = Field(description="unit, into the object")
    gap: Number = Field(description="m")
    force: Vector3 = Field(description="of the hand on the object, N")
    moment: Vector3 = Field(default=(0.0, 0.0, 0.0), description="about the point, of soft fingers, N m")
    normal_force: Number = Field(description="N")
    friction_margin: Number = Field(description="μ f_n − |f_t|, of soft fingers μ f_n − √(|f_t|² + (m/γ)²), N")


_Clearance: Any = settings_layout("ClearanceOptionsRecord", ClearanceOptions, Record)
_Loads: Any = settings_layout("LoadCasesRecord", LoadCases, Record)
_Parameters: Any = settings_layout("ParameterRecord", GraspParameters, Record)
_Search: Any = settings_layout("SearchOptionsRecord", PlannerOptions, Record)


class ClearanceOptionsRecord(_Clearance):
    """What had to keep clear of what."""


class LoadCasesRecord(_Loads):
    """What the grasp had to withstand; all zero (friction_safety one) for the paper's problem."""


class ClearanceRecord(Record):
    """The closest pair of a kind, by exact distances; in O."""

    kind: Literal["link_object", "self_collision", "ground"]
    link_a: str
    link_b: str = Field(description="a link, object or ground")
    distance: Number = Field(description="negative if they overlap, m")
    point_a: Vector3 = Field(description="m")
    point_b: Vector3 = Field(description="m")


class ParameterRecord(_Parameters):
    """Parameters of the model, what of the hand is used, and what is asked for."""

    synergy_set: str | None
    contact_set: str
    clearance: ClearanceOptionsRecord = Field(default_factory=ClearanceOptionsRecord)
    loads: LoadCasesRecord = Field(default_factory=LoadCasesRecord)


class SearchOptionsRecord(_Search):
    """How long and how hard was searched."""


class MarginRecord(Record):
    """The largest disturbance resisted along one direction."""

    size: Optional = Field(description="N, or N m along a torque; null if nothing gives way")
    direction: Vector6 = Field(description="unit disturbance in O, linear part first")
    gives_way: str = Field(description="what gives way first; empty where it is not computed")


class MarginsRecord(Record):
    """Margins against disturbing forces, with the true μ and the hand's limits; tasks: against the reaction −d."""

    passive: MarginRecord | None = Field(description="worst direction, the references held; null if undefined")
    passive_tasks: list[MarginRecord | None] = Field(description="null for motions")
    active: MarginRecord | None = Field(description="worst of 26 directions, internal forces re-optimised")
    active_tasks: list[MarginRecord | None] = Field(description="null for motions")


class StabilityRecord(Record):
    """How stiffly the object is held, the palm and the references held, preload included."""

    stable: bool
    smallest_stiffness: Number = Field(description="rotations measured as lengths at the length given, N/m")
    direction: Vector6 = Field(description="unit motion (v, length ω) in O that is resisted least")
    without_preload: Number = Field(description="smallest eigenvalue of G K Gᵀ, N/m")
    finger_stiffness: Number = Field(description="1 for free joints; not positive if a finger buckles")
    length: Number = Field(description="m")


class ClosingRecord(Record):
    """How the grasp closes from an open hand, quasi-statically, the object held and then let go; lists by contact."""

    holds: bool = Field(description="whether the closed hand holds a push along ±x, ±y, ±z")
    message: str
    pregrasp: list[Number] | None = Field(
        default=None, description="joints of the open hand to begin with, the palm as planned, rad"
    )
    references: list[list[Number]] | None = Field(
        default=None,
        description="synergy coordinates to go through, straight, rad: open, touching, the plan's or beyond",
    )
    times: list[Optional] = Field(description="of touches: 0 open, 1 touching references, 2 the plan's; null: none")
    points: list[Vector3] = Field(description="where each finger first touches, in O, m")
    mismatch: list[Number] = Field(description="of these points to the planned contacts, m")
    mismatch_force: list[Number] = Field(description="the same by the stiffness of the fingers, N")
    forces: list[Vector3] | None = Field(description="of the hand on the object at rest, N; null if it is lost")
    cone_use: list[Number] = Field(description="|f_t|/(μ f_n) at rest")
    slip: list[Number] = Field(description="over the object, m")
    overlap: Optional = Field(description="deepest of a link at rest, m; null if the object is lost, as below")
    displacement: Optional = Field(description="of the object at rest, m")
    rotation: Optional = Field(description="of the object at rest, rad")
    torque_use: Optional = Field(default=None, description="largest share of a joint's torque limit at rest")
    push: Number = Field(description="N")
    pushes: list[Optional] = Field(description="how far a push along +x, +y, +z, −x, −y, −z moves the object, m")
    holds_free: bool | None = Field(
        default=None,
        description="whether it holds the load cases' pushes where nothing holds the object as the hand closes",
    )


class ViolationRecord(Record):
    """By how much one requirement is violated."""

    value: Optional = Field(description="0 if it is met; null where infinite")
    unit: str = Field(description="1 for none")


class CostRecord(Record):
    """One cost of the objective."""

    value: Optional = Field(description="null where infinite")
    unit: str = Field(description="1 for none, and where it follows from the tasks")
    weight: Number = Field(description="in the objective, per unit")


class OwnTermsRecord(Record):
    """Names of the user's own terms; to read the grasp back, they are passed in again."""

    costs: list[str] = Field(default=[], description="keys of costs, whose weights are read from there")
    constraints: list[str] = Field(default=[], description="those that count are keys of violations")


class GraspRecord(Record):
    """A planned grasp. Frame O: the object's centre of mass; P: the palm."""

    schema_version: Literal[1] = 1
    hand: str
    hand_source: HandSourceRecord | None = Field(default=None, description="null in files written before")
    object: str
    task: list[TaskRecord] = Field(min_length=1)
    n_synergies: int = Field(ge=1)
    feasible: bool
    status: Literal["feasible", "infeasible", "cancelled"]
    message: str
    force_closed: bool
    force_closure_margin: Optional = Field(description="internal force inside the cones per unit mean f_n")
    iterations: int = Field(ge=0, description="of phase two, from the start that gave the grasp")
    phase_one_iterations: int = Field(ge=0)
    evaluations: int = Field(ge=0, description="over all starts")
    starts_tried: int = Field(ge=0)
    starts_feasible: int = Field(ge=0)
    time_s: Number
    seed: int
    search_options: SearchOptionsRecord | None = Field(default=None, description="null where they are not known")
    objective: Number = Field(description="w_F F + w_C C (C without weights), small and own costs")
    force_norm: Number = Field(description="F, N")
    force_norm_floor: Optional = Field(description="least F at these contacts, N; null if there is none")
    load_force_floor: Optional = Field(
        default=None, description="the same with every load case held, N; null also in files written before"
    )
    least_force: Optional = Field(
        default=None, description="least F that any start of the search found, N; null where weights decide"
    )
    task_index: Number = Field(description="C")
    transmission_ratios: list[Optional]
    alignment_angle_deg: Optional = Field(description="of the first task direction")
    alignment_degenerate: bool
    sigma: list[Number] = Field(description="rad")
    delta_sigma: list[Number] = Field(description="rad; zero where forces come from springs")
    joint_names: list[str]
    joint_angles: list[Number] = Field(description="q, rad")
    reference_joint_angles: list[Number] = Field(description="q_r, rad")
    joint_torques: list[Number] = Field(description="Jᵀ f, N m")
    palm_pose: PoseRecord = Field(description="of P in O")
    synergy_space: SynergySpaceRecord | None = Field(default=None, description="in use instead of a named set")
    contacts: list[ContactRecord] = Field(min_length=2)
    external_wrench: Vector6 = Field(description="on the object in O; N, N m")
    parameters: ParameterRecord
    violations: dict[str, ViolationRecord] = Field(description="of every requirement of the problem, by its name")
    costs: dict[str, CostRecord] = Field(default={}, description="by name; empty in files written before")
    own_terms: OwnTermsRecord = Field(default_factory=OwnTermsRecord)
    clearances: list[ClearanceRecord] = Field(default=[], description="the closest pair of every kind")
    margins: MarginsRecord | None = Field(default=None, description="null in files written before margins")
    stability: StabilityRecord | None = Field(default=None, description="null in files written before stability")
    closing: ClosingRecord | None = Field(
        default=None, description="null in older files, if infeasible, and where forces do not come from springs"
    )

    @field_validator("violations", mode="before")
    @classmethod
    def _from_old_names(cls, given: Any) -> Any:
        """Read the names of older files."""
        return current_violations(given)
