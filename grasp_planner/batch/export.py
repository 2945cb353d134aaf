"""Rows in the formats people use: grasp JSON, CSV of joint angles, the DexGraspBench layout.

Frames and joint orders are described in ``docs/batch.md``.
"""

from __future__ import annotations

import contextlib
import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, Literal

import numpy as np
import pinocchio as pin

from ..exceptions import InvalidValueError
from ..files.writing import make_folder, replacing, write_text
from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..records.layout import GraspRecord
from ..spatial import Array, Pose
from .errors import ResultsError
from .results import load_grasps, load_rows

Format = Literal["json", "csv", "dexgraspbench"]

PREGRASP_GAP = 0.01
"""Distance of every fingertip from the object at the pregrasp, if the first synergy can open that far [m]."""
PREGRASP_STEP = 0.025
"""Step in which postures are tried [rad]."""
PREGRASP_REACH = 1.0
"""Farthest displacement along a synergy that is tried [rad]."""
POSE_SIZE = 7
"""Numbers of a pose: position [m], then quaternion (w, x, y, z)."""
BATCH_SIZE = 200
"""Rows read at a time."""


@dataclass(frozen=True)
class DexGraspBenchGrasp:
    """One grasp in the layout of DexGraspBench.

    Attributes:
        pregrasp: Pose of the hand's root link in O, then joint angles [rad], of shape (7 + n,).
        grasp: The same for the grasp.
        squeeze: The same with the reference q_r of the soft synergies.
        joint_names: Joints, in the order of the angles.
        hand: Name of the hand.
        object: Text form of the object.
    """

    pregrasp: Array
    grasp: Array
    squeeze: Array
    joint_names: tuple[str, ...]
    hand: str
    object: str


def export_rows(
    folder: str | Path, rows: Sequence[int], target: str | Path, form: Format | str, *, all_joints: bool = False
) -> list[Path]:
    """Export rows of a run.

    Args:
        folder: Folder of the run.
        rows: Rows to export; each needs a grasp.
        target: Folder for the files; made if it does not exist.
        form: ``json``: ``row-000017.json`` each; ``csv``: one ``<hand>.csv`` for every hand; ``dexgraspbench``:
            ``<hand>/<object>/000017.npy`` each.
        all_joints: For ``dexgraspbench``: every joint of the URDF, coupled ones too.

    Returns:
        The files.

    Raises:
        ResultsError: If there is no run or a file can't be written.
        InvalidValueError: If a row has no grasp, or the format does not exist.
    """
    if form not in ("json", "csv", "dexgraspbench"):
        raise InvalidValueError("format", form, "json, csv or dexgraspbench")
    target = Path(target)
    make_folder(target, ResultsError)
    files: list[Path] = []
    tables: dict[Path, IO[bytes]] = {}
    with contextlib.ExitStack() as written:
        for first in range(0, len(rows), BATCH_SIZE):
            some = rows[first : first + BATCH_SIZE]
            if form == "dexgraspbench":
                for row, grasp in zip(some, load_grasps(folder, some), strict=True):
                    name = _file_name(grasp.problem.hand.name)
                    path = target / name / _file_name(grasp.problem.grasp_object.text) / f"{row:06d}.npy"
                    make_folder(path.parent, ResultsError)
                    write_dexgraspbench(grasp, path, all_joints=all_joints)
                    files.append(path)
                continue
            for row, record in zip(some, load_rows(folder, some), strict=True):
                if form == "json":
                    files.append(target / f"row-{row:06d}.json")
                    write_text(files[-1], record.model_dump_json(indent=2) + "\n", ResultsError)
                    continue
                path, values = target / f"{_file_name(record.hand)}.csv", csv_values(row, record)
                if path not in tables:
                    tables[path] = written.enter_context(replacing(path, ResultsError))
                    tables[path].write(_csv_line(list(values)))
                tables[path].write(_csv_line(list(values.values())))
    return list(dict.fromkeys([*files, *tables]))


def csv_values(row: int, record: GraspRecord) -> dict[str, Any]:
    """Return a grasp as a row of a CSV file of joint angles.

    Args:
        row: Number of the row.
        record: The grasp; every grasp of a file is of the same hand.

    Returns:
        Values by column.
    """
    return {
        "row": row,
        "object": record.object,
        "task": " + ".join(task.text for task in record.task),
        "n_synergies": record.n_synergies,
        "seed": record.seed,
        **dict(zip(("palm_x_m", "palm_y_m", "palm_z_m"), record.palm_pose.position, strict=True)),
        **dict(zip(("palm_qx", "palm_qy", "palm_qz", "palm_qw"), record.palm_pose.quaternion_xyzw, strict=True)),
        **{f"q_{n}_rad": q for n, q in zip(record.joint_names, record.joint_angles, strict=True)},
        **{f"qr_{n}_rad": q for n, q in zip(record.joint_names, record.reference_joint_angles, strict=True)},
    }


def _csv_line(values: Sequence[Any]) -> bytes:
    """Return one line of a CSV file."""
    line = io.StringIO(newline="")
    csv.writer(line).writerow(values)
    return line.getvalue().encode()


def pregrasp_angles(grasp: Grasp) -> Array:
    """Return a posture opened along the first synergy.

    Both ways along the first synergy are tried, up to :data:`PREGRASP_REACH`. The first posture is taken at which
    every fingertip is :data:`PREGRASP_GAP` away from the object. Where the first synergy can't do that, because it
    moves some fingers into the object, the combination of the grasp's synergies that opens all fingertips alike is
    tried too; failing that as well, the posture with the widest smallest gap is taken, at worst the grasp itself.
    Joint limits are kept.

    Args:
        grasp: The grasp.

    Returns:
        q_pre [rad], of shape (n_q,).
    """
    first = grasp.problem.synergies.basis[:, 0]
    best, widest = grasp.joint_angles, _smallest_gap(grasp, grasp.joint_angles)
    for directions in ((first, -first), (_opening_direction(grasp),)):
        for step in np.arange(1, round(PREGRASP_REACH / PREGRASP_STEP) + 1) * PREGRASP_STEP:
            for direction in directions:
                angles = _moved(grasp, step * direction)
                gap = _smallest_gap(grasp, angles)
                if gap >= PREGRASP_GAP:
                    return angles
                if gap > widest:
                    best, widest = angles, gap
    return best


def _opening_direction(grasp: Grasp) -> Array:
    """Return the direction in joint space, along the synergies, in which all gaps grow most alike."""
    basis, here = grasp.problem.synergies.basis, grasp.contacts.gaps
    small = 1e-4  # rad
    columns = [replace(grasp, joint_angles=grasp.joint_angles + small * s).contacts.gaps - here for s in basis.T]
    rates = np.column_stack(columns) / small
    direction = basis @ np.linalg.lstsq(rates, np.ones(len(here)), rcond=1e-2)[0]
    return direction / max(float(np.abs(direction).max()), 1e-12)


def _moved(grasp: Grasp, change: Array) -> Array:
    """Return the posture after a change, within the joint limits [rad]."""
    hand = grasp.problem.hand
    return np.clip(grasp.joint_angles + change, hand.lower, hand.upper)


def _smallest_gap(grasp: Grasp, angles: Array) -> float:
    """Return the smallest distance of a fingertip from the object at a posture [m]."""
    return float(replace(grasp, joint_angles=angles).contacts.gaps.min())


def dexgraspbench_grasp(grasp: Grasp, *, all_joints: bool = False) -> DexGraspBenchGrasp:
    """Return a grasp in the layout of DexGraspBench.

    Args:
        grasp: The grasp.
        all_joints: Every joint of the URDF in the order of its tree, or the independent ones in the order of q.
    """
    hand = grasp.problem.hand
    root = grasp.configuration.root_pose
    x, y, z, w = pin.Quaternion(np.array(root.rotation)).coeffs()
    pose = [*root.translation, w, x, y, z]

    def qpos(angles: Array) -> Array:
        return np.array([*pose, *(hand.full_configuration(angles) if all_joints else angles)])

    return DexGraspBenchGrasp(
        pregrasp=qpos(pregrasp_angles(grasp)),
        grasp=qpos(grasp.joint_angles),
        squeeze=qpos(grasp.reference_joint_angles),
        joint_names=tuple(hand.model.names)[1:] if all_joints else hand.joint_names,
        hand=hand.name,
        object=grasp.problem.grasp_object.text,
    )


def write_dexgraspbench(grasp: Grasp, path: Path, *, all_joints: bool = False) -> None:
    """Write a grasp as a DexGraspBench ``.npy`` file: a dictionary, pickled by NumPy.

    Args:
        grasp: The grasp.
        path: The file.
        all_joints: Every joint of the URDF, or the independent ones.

    Raises:
        ResultsError: If it can't be written.
    """
    found = dexgraspbench_grasp(grasp, all_joints=all_joints)
    data = {
        "obj_pose": np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        "obj_scale": 1.0,
        "obj_path": f"assets/grasp_planner/{_file_name(found.object)}",
        "pregrasp_qpos": found.pregrasp,
        "grasp_qpos": found.grasp,
        "squeeze_qpos": found.squeeze,
        "joint_names": list(found.joint_names),
        "hand": found.hand,
        "object": found.object,
    }
    with replacing(path, ResultsError) as file:
        np.save(file, np.array(data, dtype=object), allow_pickle=True)


def read_dexgraspbench(path: Path) -> DexGraspBenchGrasp:
    """Read a file of :func:`write_dexgraspbench`; it is a pickle, so read only files you trust.

    Raises:
        ResultsError: If it can't be read.
    """
    try:
        data = np.load(path, allow_pickle=True).item()
        return DexGraspBenchGrasp(
            pregrasp=np.asarray(data["pregrasp_qpos"], dtype=float),
            grasp=np.asarray(data["grasp_qpos"], dtype=float),
            squeeze=np.asarray(data["squeeze_qpos"], dtype=float),
            joint_names=tuple(data["joint_names"]),
            hand=data["hand"],
            object=data["object"],
        )
    except (OSError, ValueError, KeyError) as error:
        raise ResultsError(path, f"is no DexGraspBench grasp: {error}") from None


def palm_pose_of(qpos: Array, hand: Hand) -> Pose:
    """Return the pose of the palm frame P in O from a DexGraspBench pose.

    Args:
        qpos: Pose of the root link and joint angles, of shape (7 + n,).
        hand: The hand.
    """
    w, x, y, z = qpos[3:POSE_SIZE]
    return pin.SE3(pin.Quaternion(w, x, y, z).normalized().matrix(), np.array(qpos[:3])) * hand.palm_in_root


def _file_name(text: str) -> str:
    """Return a text as a name that every file system takes."""
    return re.sub(r"[^A-Za-z0-9_.=-]+", "_", text).strip("_.") or "unnamed"
