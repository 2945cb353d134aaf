"""What is to be planned: a hand, an object, a task, and the parameters of the model; checked once, then fixed."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from ..checks import finite_array
from ..exceptions import InvalidValueError, NameNotFoundError
from ..hand.contact_frame import ContactFrame
from ..hand.hand import Hand
from ..model.contact_model import ContactModel
from ..model.task_direction import TaskDirection, force_task
from ..objects import GraspObject
from ..spatial import Array, readonly
from ..synergies.space import SynergySpace
from ..values import Value
from .clearance_options import ClearanceOptions
from .load_cases import LoadCases
from .parameters import GraspParameters, plain_compliance
from .settings import setting
from .size_check import ObjectSizeWarning, size_warning
from .synergy_number import DEFAULT_SYNERGIES, MOTION_SYNERGIES
from .term import Cost, Requirement, Weighted, own_constraints, own_costs

MAX_TASKS = 64
"""Most task directions of a problem."""


@dataclass(frozen=True, eq=False, repr=False)
class GraspProblem(Value):
    """A planning problem: everything that stays fixed while the planner searches.

    Attributes:
        hand: The hand.
        grasp_object: The object.
        tasks: Task directions with weights.
        n_synergies: Number of synergies n_s; if None, three (six where a task is a twist) or as many as the set has.
        parameters: Parameters of the model.
        synergy_set: Name of the synergy set; the hand's default if None (it may name one for clearances). A CSV file
            becomes ``synergy_space``: a record holds the set and not where it lay.
        contact_set: Name of the contact set; if None, the hand's default with or without clear links.
        synergy_space: Synergies to use instead of a named set.
        clearance: What has to keep clear of what: by default links of the object and of each other.
        contacts: Names of the contacts of the set that touch, in any order; the others do not. All if None.
        loads: Disturbances and limits to withstand: by default a push of 1 N from any side, in cones of μ/1.2.
        costs: The user's own costs beside w_F F + w_C C (C without weights), as ``MyCost().weighted(0.1)``.
        constraints: The user's own constraints beside those that follow from the other fields.

    :meth:`paper` makes the paper's plain problem instead.

    Warns with :class:`ObjectSizeWarning` if the object is far too large or too small for the hand.
    """

    hand: Hand
    grasp_object: GraspObject
    tasks: tuple[TaskDirection, ...] = (force_task((0.0, 1.0, 0.0)),)
    n_synergies: int = setting(
        None,
        "Number of synergies.",
        kind="whole",
        low=1,
        none=f"{DEFAULT_SYNERGIES} ({MOTION_SYNERGIES} for twist tasks), or all of the set",
        option="--synergies",
    )
    parameters: GraspParameters = field(default_factory=GraspParameters)
    synergy_set: str | None = setting(None, "Synergy set of the hand, or a CSV file of one.", none="the hand's")
    contact_set: str | None = setting(None, "Contact set of the hand, for instance point or sphere.", none="the hand's")
    synergy_space: SynergySpace | None = None
    clearance: ClearanceOptions = field(default_factory=ClearanceOptions)
    contacts: tuple[str, ...] | None = setting(
        None,
        "Contacts of the set that touch, as name,name,….",
        none="all",
        read=lambda text: tuple(name.strip() for name in text.split(",")),
        write=",".join,
        plain=list[str],
    )
    loads: LoadCases = field(default_factory=LoadCases)
    costs: tuple[Cost | Weighted, ...] = ()
    constraints: tuple[Requirement, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "tasks", tuple(self.tasks))
        object.__setattr__(self, "costs", own_costs(self.costs))
        object.__setattr__(self, "constraints", own_constraints(self.constraints))
        if self.synergy_set is not None and self.synergy_space is None and self.synergy_set.endswith(".csv"):
            object.__setattr__(self, "synergy_space", self.hand.synergies(self.synergy_set))
            object.__setattr__(self, "synergy_set", None)
        if self.contacts is not None:
            chosen = tuple(self.contacts)
            everything = len(chosen) == len(self.hand.contact_frames(self.contact_set_name)) == len(set(chosen))
            object.__setattr__(self, "contacts", chosen)
            if everything and self.frames:  # a choice of all is no choice: equal problems are equal
                object.__setattr__(self, "contacts", None)
        if not self.tasks:
            raise InvalidValueError("tasks", (), "at least one task direction")
        if len(self.tasks) > MAX_TASKS:
            raise InvalidValueError("tasks", f"{len(self.tasks)} task directions", f"at most {MAX_TASKS}")
        object.__setattr__(self, "parameters", self.parameters.of_hand(self.hand))
        n_q = self.hand.n_joints
        if self.n_synergies is None:
            usual = MOTION_SYNERGIES if any(task.is_motion for task in self.tasks) else DEFAULT_SYNERGIES
            object.__setattr__(self, "n_synergies", min(usual, n_q, self.all_synergies.n_synergies))
        n_s = self.n_synergies
        if isinstance(n_s, bool) or not isinstance(n_s, int | np.integer) or not 1 <= n_s <= n_q:
            raise InvalidValueError("n_synergies", n_s, f"a whole number from 1 to {n_q}")
        object.__setattr__(self, "n_synergies", int(n_s))
        if n_s < MOTION_SYNERGIES and any(task.is_motion for task in self.tasks):
            raise InvalidValueError("n_synergies", n_s, "at least 6 for a twist task (β needs rank H_s = 6)")
        fewest, kind = self.contact_model.fewest_contacts, self.contact_model.kind
        if len(self.frames) < fewest:
            raise InvalidValueError(
                "contact_set, contacts",
                [frame.name for frame in self.frames],
                f"at least {fewest} contact frames where contacts are {kind}",
            )
        if self.loads.disturbed and self.parameters.contact_stiffness == 0.0:
            raise InvalidValueError("contact_stiffness", 0.0, "more than 0 N/m where there are disturbances")
        if self.loads.min_normal_force >= self.max_normal_force:
            raise InvalidValueError(
                "loads.min_normal_force",
                self.loads.min_normal_force,
                f"less than the largest, {self.max_normal_force:g} N by load cases, the hand or the object",
            )
        if not self.grasp_object.size_doubted and (message := size_warning(self.hand, self.frames, self.grasp_object)):
            warnings.warn(message, ObjectSizeWarning, stacklevel=3)
        # Evaluated here so that a wrong name or size is an error now and not in the middle of a search.
        _ = self.synergies, self.joint_compliance, self.friction

    def _content(self) -> dict[str, Any]:
        """Return the fields, those that may be left out as they are in use: equal problems ask the same."""
        used: dict[str, Any] = {
            "parameters": replace(
                self.parameters,
                joint_compliance=plain_compliance(self.joint_compliance),
                friction=tuple(self._per_contact(self.parameters.friction).tolist()),
            ),
            "synergy_set": None,
            "synergy_space": self.synergies,
            "contact_set": self.contact_set_name,
            "contacts": tuple(frame.name for frame in self.frames),
        }
        return super()._content() | used

    @classmethod
    def paper(cls, *fields: Any, **named: Any) -> GraspProblem:
        """Return the paper's plain problem (29)–(32): nothing keeps clear or disturbs, forces by (17).

        Takes the fields of a problem; those given stay as they are.
        """
        named.setdefault("clearance", ClearanceOptions.off())
        named.setdefault("loads", LoadCases.off())
        if len(fields) < 5:
            named["parameters"] = named.get("parameters", GraspParameters()).of_paper()
        else:
            fields = (*fields[:4], fields[4].of_paper(), *fields[5:])
        return cls(*fields, **named)

    @cached_property
    def frames(self) -> tuple[ContactFrame, ...]:
        """Contact frames that have to touch the object, in the order of the set."""
        frames = self.hand.contact_frames(self.contact_set_name)
        if self.contacts is None:
            return frames
        known = [frame.name for frame in frames]
        for name in self.contacts:
            if name not in known:
                raise NameNotFoundError("contact", str(name), known)
        if len(set(self.contacts)) < len(self.contacts):
            raise InvalidValueError("contacts", self.contacts, "every contact once")
        return tuple(frame for frame in frames if frame.name in self.contacts)

    @cached_property
    def grasp_centre(self) -> Array:
        """Where the middle of the object sits in P for this contact set [m], of shape (3,)."""
        return self.hand.centre_of_grasp(self.contact_set_name)

    @cached_property
    def radii(self) -> Array:
        """Fingertip radii [m], of shape (n_c,)."""
        return readonly([frame.radius for frame in self.frames])

    @property
    def contact_set_name(self) -> str | None:
        """Name of the contact set in use; None for a hand without sets."""
        return self.contact_set or self.hand.description.default_contact_set(self.clearance.link_object == "geometry")

    @property
    def synergy_set_name(self) -> str | None:
        """Name of the synergy set in use; None for a hand without sets."""
        return self.synergy_set or self.hand.description.synergies.default_for(self.clearance.needs_geometry)

    @cached_property
    def all_synergies(self) -> SynergySpace:
        """All synergies of the set or space in use, in the order of the hand's joints."""
        if self.synergy_space is not None:
            return self.synergy_space.reordered(self.hand.joint_names)
        return self.hand.synergies(self.synergy_set_name, self.joint_compliance)

    @cached_property
    def synergies(self) -> SynergySpace:
        """The first n_s synergies, in the order of the hand's joints."""
        return self.all_synergies.truncated(self.n_synergies)

    @cached_property
    def joint_compliance(self) -> Array:
        """C_q [rad/(N m)], its diagonal of shape (n_q,), or of shape (n_q, n_q) where joints bend each other."""
        given, n_q = self.parameters.joint_compliance, self.hand.n_joints
        if np.ndim(given) == 2:
            matrix = finite_array("joint_compliance", given, (n_q, n_q))
            return matrix if np.any(matrix[~np.eye(n_q, dtype=bool)]) else readonly(np.diag(matrix))
        return finite_array("joint_compliance", np.full(n_q, given) if np.ndim(given) == 0 else given, (n_q,))

    @property
    def rigid_joints(self) -> npt.NDArray[np.bool_]:
        """Which joints have no compliance, of shape (n_q,)."""
        c_q = self.joint_compliance
        return np.asarray((np.diag(c_q) if c_q.ndim == 2 else c_q) <= 0.0)

    @property
    def contact_model(self) -> ContactModel:
        """What every contact transmits."""
        return self.parameters.contact_model

    @cached_property
    def friction(self) -> Array:
        """Coefficient of friction μ of every contact, one where there is no friction to count, of shape (n_c,)."""
        mu = self._per_contact(self.parameters.friction)
        return mu if self.contact_model.has_friction else readonly(np.ones_like(mu))

    @cached_property
    def contact_springs(self) -> Array:
        """K_c against the motion of every intensity of every contact [N/m], of shape (d n_c,)."""
        factors = np.tile(self.contact_model.stiffness_factors, len(self.frames))
        return readonly(self.parameters.contact_stiffness * factors)

    @cached_property
    def structural_compliances(self) -> Array:
        """C_s along the motion of every intensity of every contact [m/N], of shape (d n_c,)."""
        factors = np.tile(self.contact_model.stiffness_factors, len(self.frames))
        return readonly(self.parameters.structural_compliance / factors)

    def _per_contact(self, given: float | tuple[float, ...]) -> Array:
        """Return a coefficient of friction for every contact, of shape (n_c,)."""
        n_c = len(self.frames)
        if np.ndim(given) and np.shape(given) != (n_c,):
            raise InvalidValueError("friction", given, f"one number, or {n_c}, one for each contact")
        return readonly(np.broadcast_to(np.asarray(given, dtype=float), n_c))

    @cached_property
    def max_normal_force(self) -> float:
        """Largest normal force of a contact, by load cases or hand, and by the object [N]; infinite without a limit."""
        limit = self.loads.max_normal_force
        if limit is None:
            limit = self.hand.max_normal_force if self.loads.hand_limits else np.inf
        return min(limit, *(self.grasp_object.bearable_force(radius) for radius in self.radii))

    @cached_property
    def torque_limits(self) -> Array:
        """Largest torque of every joint [N m], infinite without a limit, of shape (n_q,)."""
        limits = self.hand.torque_limits
        return limits if self.loads.hand_limits else readonly(np.full_like(limits, np.inf))

    @cached_property
    def external_wrench(self) -> Array:
        """w_ext [N, N m] in O, of shape (6,): the weight, acting at the centre of mass."""
        return readonly(np.concatenate([self.grasp_object.mass * self.parameters.gravity, np.zeros(3)]))

    @cached_property
    def up(self) -> Array:
        """Unit direction opposite to gravity in O, of shape (3,); +z without gravity."""
        gravity = self.parameters.gravity
        size = float(np.linalg.norm(gravity))
        return readonly(-gravity / size) if size > 0.0 else readonly([0.0, 0.0, 1.0])

    @cached_property
    def abduction_differences(self) -> Array:
        """Matrix whose product with q has to be ≥ 0 by Remark 1, of shape (m, n_q); m = 0 for hands without one."""
        order = self.hand.description.remark1
        joints = order.abduction_order if order is not None else ()
        rows = np.zeros((max(len(joints) - 1, 0), self.hand.n_joints))
        for row, (first, second) in zip(rows, pairwise(joints), strict=True):
            row[self.hand.joint_index(first)] -= order.sign if order is not None else 0
            row[self.hand.joint_index(second)] += order.sign if order is not None else 0
        return readonly(rows)
