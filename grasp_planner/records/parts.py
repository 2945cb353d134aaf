"""Parts of the JSON form of a grasp: pose, synergies, clearances, margins, stability."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from ..closing.report import ClosingReport
from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..judge.clearance_check import ClearanceKind, least_distance
from ..judge.margins import GraspMargins, Margin
from ..judge.stability import Stability
from ..spatial import Pose, readonly
from ..synergies.space import SynergySpace
from .layout import (
    ClearanceRecord,
    ClosingRecord,
    MarginRecord,
    MarginsRecord,
    PoseRecord,
    StabilityRecord,
    SynergySpaceRecord,
)

SAME_ROTATION = 1e-4
"""How far matrix and quaternion of a pose may differ."""


def finite_or_none(value: float) -> float | None:
    """Return a finite number, or None."""
    return float(value) if math.isfinite(value) else None


def pose_record(pose: Pose) -> PoseRecord:
    """Return the record of a pose."""
    return PoseRecord(
        position=pose.translation.tolist(),
        quaternion_xyzw=np.array(pin.Quaternion(np.array(pose.rotation)).coeffs()).tolist(),
        rotation=pose.rotation.tolist(),
    )


def pose_from_record(record: PoseRecord) -> Pose:
    """Return the pose of a record: by its matrix, or by its quaternion where there is none.

    Raises:
        InvalidValueError: If the two differ.
    """
    turned = pin.Quaternion(readonly(record.quaternion_xyzw)).normalized().matrix()
    rotation = turned if record.rotation is None else readonly(record.rotation)
    if np.abs(rotation - turned).max() > SAME_ROTATION:
        raise InvalidValueError("palm_pose.rotation", rotation.tolist(), "the matrix of quaternion_xyzw, or null")
    return Pose.of(pin.SE3(rotation, readonly(record.position)))


def synergy_space_record(space: SynergySpace | None) -> SynergySpaceRecord | None:
    """Return the record of synergies; None if there are none."""
    if space is None:
        return None
    return SynergySpaceRecord(
        joint_names=list(space.joint_names),
        mean=space.mean.tolist(),
        basis=space.basis.tolist(),
        variance=None if space.variance is None else space.variance.tolist(),
        name=space.name,
        provenance=space.provenance,
    )


def synergy_space_from_record(record: SynergySpaceRecord | None) -> SynergySpace | None:
    """Return the synergies of a record; None if there are none.

    Raises:
        InvalidValueError: If they are no synergies of their joints.
    """
    if record is None:
        return None
    if len({len(row) for row in record.basis}) != 1:
        raise InvalidValueError("synergy_space.basis", "rows of different length", "rows of one length")
    return SynergySpace(**record.model_dump())


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


def closing_record(closing: ClosingReport) -> ClosingRecord:
    """Return the record of how a grasp closes."""
    return ClosingRecord(
        holds=closing.holds,
        message=closing.text,
        pregrasp=closing.pregrasp.tolist(),
        references=[closing.path.at(time).tolist() for time in (0.0, 1.0, 2.0)],
        times=[finite_or_none(time) for time in closing.times],
        points=closing.points.tolist(),
        mismatch=closing.mismatch.tolist(),
        mismatch_force=closing.mismatch_force.tolist(),
        forces=closing.forces.tolist() if closing.rests else None,
        cone_use=closing.cone_use.tolist(),
        slip=closing.slip.tolist(),
        overlap=finite_or_none(closing.overlap),
        displacement=finite_or_none(closing.displacement),
        rotation=finite_or_none(closing.rotation),
        torque_use=finite_or_none(closing.torque_use),
        push=closing.push,
        pushes=[finite_or_none(moved) for moved in closing.pushes],
        holds_free=closing.holds_free,
    )
