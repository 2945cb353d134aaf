"""Plan everyday meshes by default options and check every grasp on the exact triangles.

Usage: ``python scripts/check_objects.py [--hands dlr_hit_ii_right,allegro_right] [--only can,mug] [--out FOLDER]``

Grids are built anew, and their processor time counts.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import igl
import numpy as np
from everyday_meshes import EVERYDAY

import grasp_planner as gp
from grasp_planner.judge.surface_check import FOOTPRINT, SPREAD
from grasp_planner.objects.mesh_object import MeshObject
from grasp_planner.objects.normal_spread import normal_spread
from grasp_planner.objects.triangles import Triangles


def exact_contacts(grasp: gp.Grasp) -> tuple[float, int, int]:
    """Return what libigl says of the contacts: largest gap [m], contacts on edges, forces outside their true cones."""
    mesh = grasp.problem.grasp_object.mesh
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    contacts, radii = grasp.contacts, grasp.problem.radii
    centres = contacts.points - radii[:, None] * contacts.normals
    kind = igl.SIGNED_DISTANCE_TYPE_WINDING_NUMBER
    distance, _, nearest, _ = igl.signed_distance(centres, vertices, faces, sign_type=kind)
    inward = (nearest - centres) / distance[:, None]
    pressing = (grasp.forces * inward).sum(axis=1)
    sliding = np.linalg.norm(grasp.forces - pressing[:, None] * inward, axis=1)
    outside = sliding > grasp.problem.friction * pressing + 1e-6
    on_edge = normal_spread(Triangles.of(mesh), np.asarray(nearest), FOOTPRINT) > SPREAD + 1e-6
    return float(np.abs(distance - radii).max()), int(on_edge.sum()), int(outside.sum())


def planned(hand: gp.Hand, name: str, folder: Path) -> dict[str, Any]:
    """Return the row of an object and a hand."""
    mass, make = EVERYDAY[name]
    path = folder / f"{name}.ply"
    if not path.exists():
        make().export(path)
    began = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        thing = MeshObject.load(path, mass=mass)
    loaded = time.process_time()
    grasp = gp.plan_grasp(gp.GraspProblem(hand, thing))
    ended = time.process_time()
    gap, edges, outside = exact_contacts(grasp)
    return {
        "object": name,
        "hand": hand.name,
        "feasible": bool(grasp.feasible),
        "gap_mm": 1e3 * gap,
        "on_edges": edges,
        "outside_cones": outside,
        "penetration_mm": 1e3 * grasp.overlap("link_object"),
        "grid_s": loaded - began,
        "grid_error_mm": 1e3 * thing.distance_error,
        "plan_s": ended - loaded,
        "verdict": grasp.verdict if not grasp.feasible else "",
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as tables in Markdown, one a hand, each with what all of its rows say."""
    hands = dict.fromkeys(row["hand"] for row in rows)
    return "\n\n".join(table_of_hand(hand, [row for row in rows if row["hand"] == hand]) for hand in hands)


def table_of_hand(hand: str, rows: list[dict[str, Any]]) -> str:
    """Return the rows of one hand."""
    lines = [
        f"| {hand} | feasible | off the triangles [mm] | grid's stated error [mm] | overlap [mm] | processor [s] |"
    ]
    lines.append("|---|---|---|---|---|---|")
    for row in rows:
        lines.append(
            f"| {row['object']} | {'yes' if row['feasible'] else 'no'} | {row['gap_mm']:.3f} "
            f"| {row['grid_error_mm']:.2f} | {row['penetration_mm']:.3f} | {row['grid_s']:.0f} + {row['plan_s']:.0f} |"
        )
    found = [row for row in rows if row["feasible"]]
    seconds = [row["grid_s"] + row["plan_s"] for row in rows]
    lines.append("")
    lines.append(
        f"{hand}: {len(found)} of {len(rows)} feasible; of these farthest off the triangles "
        f"{max((row['gap_mm'] for row in found), default=0.0):.3f} mm, contacts on edges "
        f"{sum(row['on_edges'] for row in found)}, forces outside true cones "
        f"{sum(row['outside_cones'] for row in found)}, "
        f"deepest overlap {max((row['penetration_mm'] for row in found), default=0.0):.3f} mm; grid and plan take "
        f"{np.median(seconds):.0f} s of processor time in the median, {np.quantile(seconds, 0.9):.0f} s at the 90th "
        "percentile."
    )
    return "\n".join(lines)


def main() -> None:
    """Plan, and print the tables; rows are kept in a file as they come, and what is there is not planned again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hands", default="dlr_hit_ii_right,allegro_right")
    parser.add_argument("--only", default=",".join(EVERYDAY))
    parser.add_argument("--out", type=Path, default=None)
    arguments = parser.parse_args()
    folder = arguments.out or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    kept = folder / "rows.jsonl"
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    for name in arguments.only.split(","):
        for hand_name in arguments.hands.split(","):
            if any((row["object"], row["hand"]) == (name, hand_name) for row in rows):
                continue
            os.environ["XDG_CACHE_HOME"] = tempfile.mkdtemp()
            rows.append(planned(gp.load_hand(hand_name), name, folder))
            with kept.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
