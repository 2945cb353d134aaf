"""The JSON form of an analysis: margins, stability, tolerance and post-optimality of one grasp, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from ..analysis.measures import Measure
from ..analysis.sensitivity import PostOptimality, Sensitivity
from ..analysis.tolerance import QUESTION, Tolerance, pose_tolerances
from ..grasp.grasp import Grasp
from .layout import MarginsRecord, Number, Optional, Record, StabilityRecord
from .parts import finite_or_none, margins_record, stability_record


class ToleranceRecord(Record):
    """How far one coordinate of the object's pose may be off before something gives way."""

    coordinate: str
    unit: Literal["m", "rad"]
    down: Optional = Field(description="in the negative direction; null if nothing gives way")
    up: Optional
    gives_way_down: str
    gives_way_up: str
    question: str = Field(default=QUESTION, description="what the tolerance is the answer to")


class SensitivityRecord(Record):
    """How the optimum answers one parameter, per its unit, to first order."""

    parameter: str
    unit: str
    value: Number
    follows: bool = Field(description="whether a neighbouring grasp keeps all active constraints; if not, null below")
    d_force_norm: Optional = Field(description="dF*/dp")
    d_task_index: Optional = Field(description="dC*/dp")
    d_objective: Optional = Field(description="d(objective)/dp")
    d_joint_angles: list[Optional]
    d_palm: list[Optional] = Field(description="translation, rotation vector, in O")
    d_delta_sigma: list[Optional]
    down: Optional = Field(description="largest decrease for which the active set stays and F follows to 5 %")
    up: Optional
    ends_down: str
    ends_up: str


class PostOptimalityRecord(Record):
    """The optimum near the grasp."""

    force_norm: Number
    objective: Number
    stationarity: Number = Field(description="what is left of the gradient of the Lagrangian, relative")
    flat_directions: int
    curvature: Number = Field(description="least, relative to the largest, but for the flat directions")
    active: list[tuple[str, Number]] = Field(description="active inequalities with multipliers of the scaled program")
    sensitivities: list[SensitivityRecord]


class MeasureRecord(Record):
    """One measure of a grasp."""

    group: str
    name: str
    value: Optional = Field(description="null where there is no number")
    unit: str
    text: str = Field(description="a word instead of a number")


class AnalysisRecord(Record):
    """An analysis of a grasp."""

    schema_version: Literal[1] = 1
    message: str
    force_norm: Number
    margins: MarginsRecord
    stability: StabilityRecord
    tolerances: list[ToleranceRecord]
    post_optimality: PostOptimalityRecord | None
    measures: list[MeasureRecord] = Field(default=[], description="of hard fingers; none of other contacts")


class ContactAnalysisRecord(Record):
    """An analysis of contacts from elsewhere."""

    schema_version: Literal[1] = 1
    measures: list[MeasureRecord]


def contact_analysis_record(found: Sequence[Measure]) -> ContactAnalysisRecord:
    """Return the record of measures of contacts."""
    return ContactAnalysisRecord(measures=[_measure(each) for each in found])


def analysis_record(grasp: Grasp, found: PostOptimality | None, measured: Sequence[Measure] = ()) -> AnalysisRecord:
    """Return the record of an analysis.

    Args:
        grasp: The grasp.
        found: Its post-optimality; None if it was left out.
        measured: Its measures.

    Returns:
        The record.
    """
    return AnalysisRecord(
        message=grasp.verdict,
        force_norm=grasp.force_norm,
        margins=margins_record(grasp.margins),
        stability=stability_record(grasp.stability),
        tolerances=[_tolerance(tolerance) for tolerance in pose_tolerances(grasp)],
        post_optimality=None if found is None else _post_optimality(found),
        measures=[_measure(each) for each in measured],
    )


def _measure(found: Measure) -> MeasureRecord:
    """Return the record of a measure."""
    value = finite_or_none(found.value)
    return MeasureRecord(group=found.group, name=found.name, value=value, unit=found.unit, text=found.text)


def _tolerance(tolerance: Tolerance) -> ToleranceRecord:
    """Return the record of a tolerance."""
    return ToleranceRecord(
        coordinate=tolerance.coordinate,
        unit="rad" if tolerance.unit == "rad" else "m",
        down=finite_or_none(tolerance.down),
        up=finite_or_none(tolerance.up),
        gives_way_down=tolerance.gives_way_down,
        gives_way_up=tolerance.gives_way_up,
    )


def _post_optimality(found: PostOptimality) -> PostOptimalityRecord:
    """Return the record of the optimum and its sensitivities."""
    return PostOptimalityRecord(
        force_norm=found.grasp.force_norm,
        objective=found.grasp.objective,
        stationarity=found.stationarity,
        flat_directions=found.flat,
        curvature=found.curvature,
        active=list(found.active),
        sensitivities=[_sensitivity(sensitivity) for sensitivity in found.sensitivities],
    )


def _sensitivity(found: Sensitivity) -> SensitivityRecord:
    """Return the record of a sensitivity."""
    return SensitivityRecord(
        parameter=found.name,
        unit=found.unit,
        value=found.value,
        follows=found.follows,
        d_force_norm=finite_or_none(found.d_force_norm),
        d_task_index=finite_or_none(found.d_task_index),
        d_objective=finite_or_none(found.d_objective),
        d_joint_angles=[finite_or_none(value) for value in found.d_joint_angles],
        d_palm=[finite_or_none(value) for value in found.d_palm],
        d_delta_sigma=[finite_or_none(value) for value in found.d_delta_sigma],
        down=finite_or_none(found.down),
        up=finite_or_none(found.up),
        ends_down=found.ends_down,
        ends_up=found.ends_up,
    )
