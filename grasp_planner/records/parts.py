"""Parts of the JSON form of a grasp: clearances, margins, stability."""

from __future__ import annotations

import math

from ..grasp.grasp import Grasp
from ..judge.clearance_check import ClearanceKind, least_distance
from ..judge.margins import GraspMargins, Margin
from ..judge.stability import Stability
from .layout import ClearanceRecord, MarginRecord, MarginsRecord, StabilityRecord


def finite_or_none(value: float) -> float | None:
    """Return a finite number, or None."""
    return float(value) if math.isfinite(value) else None


def clearance_records(grasp: Grasp) -> list[ClearanceRecord]:
    """Return the records of the closest pair of every kind."""
    kinds: tuple[ClearanceKind, ...] = ("link_object", "self_collision", "ground")
    closest = (least_distance(grasp.clearances, kind) for kind in kinds)
    return [
        ClearanceRecord(
            kind=pair.kind,
            link_a=pair.link_a,
            link_b=pair.link_b,
            distance=pair.distance,
            point_a=pair.point_a.tolist(),
            point_b=pair.point_b.tolist(),
        )
        for pair in closest
        if pair is not None
    ]


def margins_record(margins: GraspMargins) -> MarginsRecord:
    """Return the record of the margins."""

    def one(margin: Margin | None) -> MarginRecord | None:
        if margin is None or math.isnan(margin.size):
            return None
        return MarginRecord(
            size=finite_or_none(margin.size), direction=margin.direction.tolist(), gives_way=margin.gives_way
        )

    return MarginsRecord(
        passive=one(margins.passive),
        passive_tasks=[one(margin) for margin in margins.passive_tasks],
        active=one(margins.active),
        active_tasks=[one(margin) for margin in margins.active_tasks],
    )


def stability_record(stability: Stability) -> StabilityRecord:
    """Return the record of the stability."""
    return StabilityRecord(
        stable=stability.stable,
        smallest_stiffness=stability.smallest,
        direction=stability.direction.tolist(),
        without_preload=stability.without_preload,
        finger_stiffness=stability.finger_stiffness,
        length=stability.length,
    )
