#!/usr/bin/env python3
"""Plan the grasps that tests start from, and write them to tests/data.

In which local minimum a search ends depends on the processor; a grasp that is read from a file is the same
everywhere. Run it again only if a file can no longer be read: tests assert properties that any feasible grasp of these
problems has, so that a new one does as well as the old one. It takes about a minute.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

import grasp_planner as gp
from grasp_planner.analysis.sensitivity import optimum_near
from grasp_planner.studies.benchmark_problems import BenchmarkCase

FOLDER = Path(__file__).resolve().parents[1] / "tests" / "data"
HAND = "dlr_hit_ii_right"
NONE, PUSH, HALF = gp.LoadCases.off(), gp.LoadCases(), gp.LoadCases(force=0.5)
HARD = replace(NONE, min_normal_force=10.5)
EVERYTHING = gp.LoadCases(
    force=0.6,
    torque=0.01,
    acceleration=5.0,
    position_error=2e-5,
    rotation_error=5e-4,
    wrenches=((0.3, 0.0, -0.2, 0.0, 0.005, 0.0),),
)


def paper(shape: gp.GraspObject, n_synergies: int, loads: gp.LoadCases = NONE, **named: str) -> gp.GraspProblem:
    """Return the paper's problem without clearances."""
    # All of a contact force bends the joints, so that a grasp is at rest and may be disturbed.
    total = gp.GraspParameters(torque_model="total")
    hand = gp.load_hand(HAND)
    return gp.GraspProblem.paper(hand, shape, n_synergies=n_synergies, parameters=total, loads=loads, **named)


def clear(text: str, **options: float) -> gp.GraspProblem:
    """Return a problem with every clearance, round fingertips and a push."""
    asked = gp.ClearanceOptions(**options)
    return gp.GraspProblem(gp.load_hand(HAND), gp.parse_object(text), clearance=asked, contact_set="sphere")


def problems() -> dict[str, gp.GraspProblem]:
    """Return the problems by the name of their file."""
    cylinder, ball = gp.Cylinder(), gp.Sphere(radius=0.035)
    return {
        "paper": paper(cylinder, 3),
        "push": paper(cylinder, 5, PUSH),
        "loads": paper(cylinder, 8, EVERYTHING, contact_set="sphere"),
        "clear": clear("cylinder:radius=0.03,height=0.12"),
        "ground": clear("cylinder:radius=0.03,height=0.12", ground=-0.06),
        "point_cylinder": paper(cylinder, 8, PUSH, contact_set="point"),
        "point_sphere": paper(ball, 8, PUSH, contact_set="point"),
        "round_cylinder": paper(cylinder, 8, PUSH, contact_set="sphere"),
        "round_sphere": paper(ball, 8, PUSH, contact_set="sphere"),
        "native_3": paper(cylinder, 3, synergy_set="native"),
        "native_3_push": paper(cylinder, 3, PUSH, synergy_set="native"),
        "native_5_half": paper(cylinder, 5, HALF, synergy_set="native"),
        "native_15": paper(cylinder, 15, synergy_set="native"),
        "native_15_push": paper(cylinder, 15, PUSH, synergy_set="native"),
        "round_15": paper(gp.Cylinder(radius=0.036), 15, synergy_set="native", contact_set="sphere"),
        "default_box": BenchmarkCase(0, 8, HAND, "box", "native_free", clearance=True, loads=True).problem(),
        "beyond_limits": paper(gp.Cylinder(radius=0.035), 5, HARD, synergy_set="santello"),
    }


OPTIMA = ("native_3", "native_3_push", "native_15", "native_15_push")
"""Those that are brought to the optimum itself."""


@click.command(help=__doc__)
@click.argument("names", nargs=-1)
def main(names: tuple[str, ...]) -> None:
    """Plan and write the named grasps, all of them if none is named."""
    for name, problem in problems().items():
        if names and name not in names:
            continue
        grasp = gp.plan_grasp(problem, seed=1, options=gp.PlannerOptions(starts=20, enough=1))
        if name in OPTIMA:
            grasp = optimum_near(grasp)
        if not grasp.feasible:
            raise click.ClickException(f"{name}: {grasp.verdict}")
        (FOLDER / f"{name}.json").write_text(gp.grasp_json(grasp), encoding="utf-8")
        click.echo(f"{name}: F {grasp.force_norm:.4g} N, C {grasp.task_index:.3g}; {grasp.verdict}")


if __name__ == "__main__":
    main()
