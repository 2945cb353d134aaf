"""The JSON form of a grasp: a contract of plain numbers in SI units, checked when written and when read."""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np

from ..grasp.grasp import Grasp, SearchReport
from ..hand.hand import Hand
from ..model.contact_model import HardFinger
from ..model.task_direction import parse_task
from ..objects import parse_object
from ..problem.clearance_options import ClearanceOptions
from ..problem.load_cases import LoadCases
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..problem.term import Cost, Requirement, Weighted
from ..spatial import Array, readonly
from .hand_record import hand_from_record, hand_source_record
from .layout import (
    ClearanceOptionsRecord,
    ContactRecord,
    GraspRecord,
    LoadCasesRecord,
    ParameterRecord,
    SearchOptionsRecord,
    TaskRecord,
)
from .parts import (
    clearance_records,
    closing_record,
    finite_or_none,
    margins_record,
    pose_from_record,
    pose_record,
    stability_record,
    synergy_space_from_record,
    synergy_space_record,
)
from .settings import plain_settings, settings_from
from .terms import cost_records, own_terms_of, own_terms_record, violation_records


def grasp_record(grasp: Grasp) -> GraspRecord:
    """Return the record of a grasp; every number is computed by the grasp itself."""
    problem, search = grasp.problem, grasp.search or SearchReport(seed=0)
    tasks = _task_records(grasp)
    springs = problem.parameters.force_law == "springs"
    return GraspRecord(
        hand=problem.hand.name,
        hand_source=hand_source_record(problem.hand),
        object=problem.grasp_object.text,
        task=tasks,
        n_synergies=problem.n_synergies,
        feasible=grasp.feasible,
        status=grasp.status,
        message=grasp.verdict,
        force_closed=grasp.force_closed,
        force_closure_margin=finite_or_none(grasp.force_closure_margin),
        iterations=search.iterations,
        phase_one_iterations=search.phase_one_iterations,
        evaluations=search.evaluations,
        starts_tried=search.starts_tried,
        starts_feasible=search.starts_feasible,
        time_s=search.time_s,
        seed=search.seed,
        search_options=_search_options_record(search.options),
        objective=grasp.objective,
        force_norm=grasp.force_norm,
        force_norm_floor=finite_or_none(grasp.force_norm_floor),
        load_force_floor=finite_or_none(grasp.load_force_floor),
        least_force=search.least_force,
        task_index=grasp.task_index,
        transmission_ratios=[task.transmission_ratio for task in tasks],
        alignment_angle_deg=tasks[0].alignment_angle_deg,
        alignment_degenerate=tasks[0].alignment_degenerate,
        sigma=grasp.sigma.tolist(),
        delta_sigma=grasp.delta_sigma.tolist(),
        joint_names=list(problem.hand.joint_names),
        joint_angles=grasp.joint_angles.tolist(),
        reference_joint_angles=grasp.reference_joint_angles.tolist(),
        joint_torques=grasp.joint_torques.tolist(),
        palm_pose=pose_record(grasp.palm_pose),
        synergy_space=synergy_space_record(problem.synergy_space),
        contacts=_contact_records(grasp),
        external_wrench=problem.external_wrench.tolist(),
        parameters=_parameter_record(problem),
        violations=violation_records(grasp),
        costs=cost_records(grasp),
        own_terms=own_terms_record(problem),
        clearances=clearance_records(grasp),
        margins=margins_record(grasp.margins),
        stability=stability_record(grasp.stability),
        closing=closing_record(grasp.closing) if grasp.feasible and springs else None,
    )


def _task_records(grasp: Grasp) -> list[TaskRecord]:
    """Return the records of all tasks."""
    return [
        TaskRecord(
            text=task.text,
            kind=task.kind,
            direction=task.direction.tolist(),
            weight=task.weight,
            transmission_ratio=finite_or_none(ratio),
            alignment_angle_deg=finite_or_none(angle),
            alignment_degenerate=degenerate,
        )
        for task, ratio, (angle, degenerate) in zip(
            grasp.problem.tasks, grasp.transmission_ratios, grasp.alignments, strict=True
        )
    ]


def _contact_records(grasp: Grasp) -> list[ContactRecord]:
    """Return the records of all contacts."""
    contacts = grasp.contacts
    return [
        ContactRecord(
            name=frame.name,
            link=frame.link,
            frame=frame.frame,
            radius=frame.radius,
            point=contacts.points[i].tolist(),
            normal=contacts.normals[i].tolist(),
            gap=float(contacts.gaps[i]),
            force=grasp.forces[i].tolist(),
            moment=grasp.moments[i].tolist(),
            normal_force=float(grasp.normal_forces[i]),
            friction_margin=float(grasp.friction_margins[i]),
        )
        for i, frame in enumerate(grasp.problem.frames)
    ]


def _parameter_record(problem: GraspProblem) -> ParameterRecord:
    """Return the record of the parameters."""
    return ParameterRecord(
        **plain_settings(problem.parameters),
        synergy_set=problem.synergy_set_name if problem.synergy_space is None else None,
        contact_set=problem.contact_set_name or "",
        clearance=ClearanceOptionsRecord(**plain_settings(problem.clearance)),
        loads=LoadCasesRecord(**plain_settings(problem.loads)),
    )


def _search_options_record(options: PlannerOptions | None) -> SearchOptionsRecord | None:
    """Return the record of how the search was asked to search; None if that is not known."""
    return None if options is None else SearchOptionsRecord(**plain_settings(options))


def grasp_from_record(
    record: GraspRecord,
    hand: Hand | None = None,
    *,
    costs: Iterable[Cost | Weighted] = (),
    constraints: Iterable[Requirement] = (),
) -> Grasp:
    """Return the grasp of a record; every derived number is computed anew.

    Args:
        record: The record.
        hand: The hand to take; the one of the record's files if left out, see :func:`hand_from_record`.
        costs: The user's own costs that it names; their weights are the record's.
        constraints: The user's own constraints that it names.

    Returns:
        The grasp, without the history of its search.

    Raises:
        GraspPlannerError: If the hand, object, task or a parameter does not exist or is out of range, or an own term
            is missing.
    """
    hand = hand_from_record(record.hand, record.hand_source, hand)
    given = record.parameters
    weighted, required = own_terms_of(record, costs, constraints)
    problem = GraspProblem(
        hand=hand,
        grasp_object=parse_object(record.object),
        tasks=tuple(parse_task(task.text) for task in record.task),
        n_synergies=record.n_synergies,
        parameters=settings_from(GraspParameters, given),
        synergy_set=given.synergy_set,
        contact_set=given.contact_set,
        synergy_space=synergy_space_from_record(record.synergy_space),
        clearance=settings_from(ClearanceOptions, given.clearance),
        contacts=tuple(contact.name for contact in record.contacts),
        loads=settings_from(LoadCases, given.loads),
        costs=weighted,
        constraints=required,
    )
    springs = problem.parameters.force_law == "springs"
    report = SearchReport(
        seed=record.seed,
        iterations=record.iterations,
        phase_one_iterations=record.phase_one_iterations,
        evaluations=record.evaluations,
        starts_tried=record.starts_tried,
        starts_feasible=record.starts_feasible,
        least_force=record.least_force,
        time_s=record.time_s,
        message=record.message,
        cancelled=record.status == "cancelled",
        options=None if record.search_options is None else settings_from(PlannerOptions, record.search_options),
    )
    return Grasp(
        problem=problem,
        joint_angles=readonly(record.joint_angles),
        palm_pose=pose_from_record(record.palm_pose),
        delta_sigma=readonly(record.delta_sigma),
        contact_forces=_intensities(record, problem) if springs else None,
        search=report,
    )


def _intensities(record: GraspRecord, problem: GraspProblem) -> Array:
    """Return the intensities of a record's contacts [N], of shape (n_c, d)."""
    forces = readonly([contact.force for contact in record.contacts])
    if isinstance(problem.contact_model, HardFinger):
        return forces
    wrenches = np.hstack([forces, readonly([contact.moment for contact in record.contacts])])
    bases = problem.contact_model.basis(readonly([contact.normal for contact in record.contacts]))
    return readonly([np.linalg.lstsq(h, w, rcond=None)[0] for h, w in zip(bases, wrenches, strict=True)])


def record_schema() -> str:
    """Return the JSON schema of the contract, as text."""
    return json.dumps(GraspRecord.model_json_schema(), indent=2, ensure_ascii=False) + "\n"
