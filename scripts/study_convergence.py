"""Study of convergence: the same seeded starts through variants of the search; prints a Markdown table.

Usage: python scripts/study_convergence.py [--starts N] [--synergy-set NAME] [--counts 1,2,3,5,15]
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from scipy.optimize import BFGS, SR1, NonlinearConstraint, minimize

import grasp_planner as gp
from grasp_planner.grasp.search_report import SearchReport
from grasp_planner.planning import program
from grasp_planner.planning.preparation import prepare_start

Variant = Callable[[gp.GraspProblem, gp.GraspStart], gp.Grasp]
ONE = gp.PlannerOptions(starts=1)


def single(problem: gp.GraspProblem, start: gp.GraspStart, **options: object) -> gp.Grasp:
    """Plan from one start."""
    return gp.plan_grasp(problem, start=start, options=replace(ONE, **options))


def by_sqp(problem: gp.GraspProblem, start: gp.GraspStart, **options: object) -> gp.Grasp:
    """Plan from one start, both phases by SQP."""
    return single(problem, replace(start, prepared=True), phase_one=True, **options)


@contextmanager
def unscaled() -> Iterator[None]:
    """Switch the scaling of variables off."""
    names = ("JOINT_SCALE", "TRANSLATION_SCALE", "ROTATION_SCALE", "UNIT_FORCE_ARM")
    kept = {name: getattr(program, name) for name in names}
    for name in names:
        setattr(program, name, 1.0)
    program.UNIT_FORCE_ARM = 1e-5  # δσ in rad: the scale 1/(arm · K_c) becomes one
    try:
        yield
    finally:
        for name, value in kept.items():
            setattr(program, name, value)


def without_scaling(problem: gp.GraspProblem, start: gp.GraspStart) -> gp.Grasp:
    """Both phases in plain SI units."""
    with unscaled():
        return by_sqp(problem, start)


def chained(problems: list[gp.GraspProblem], start: gp.GraspStart) -> gp.Grasp:
    """Solve problems one after the other, each from the result of the one before."""
    grasp = None
    for problem in problems:
        if grasp is not None:
            delta_sigma = np.zeros(problem.n_synergies)
            n = min(problem.n_synergies, grasp.problem.n_synergies)
            delta_sigma[:n] = grasp.delta_sigma[:n]
            start = gp.GraspStart(grasp.joint_angles, grasp.palm_pose, delta_sigma)
        elif len(start.delta_sigma) != problem.n_synergies:
            start = replace(start, delta_sigma=np.zeros(problem.n_synergies))
        grasp = by_sqp(problem, start)
    assert grasp is not None
    return grasp


def fewer_synergies(problem: gp.GraspProblem, start: gp.GraspStart) -> gp.Grasp:
    """Continuation in n_s from 15 down."""
    steps = [n for n in (15, 8, 5, 3, 2, 1) if n > problem.n_synergies] + [problem.n_synergies]
    return chained([replace(problem, n_synergies=n) for n in steps], start)


def less_compliance(problem: gp.GraspProblem, start: gp.GraspStart) -> gp.Grasp:
    """Continuation in the joint compliance, from ten times as soft."""
    softer = [replace(problem.parameters, joint_compliance=value) for value in (1.0, 0.3)]
    return chained([*(replace(problem, parameters=each) for each in softer), problem], start)


def less_friction(problem: gp.GraspProblem, start: gp.GraspStart) -> gp.Grasp:
    """Continuation in friction, from μ = 1.6."""
    rougher = [replace(problem.parameters, friction=value) for value in (1.6, 1.1)]
    return chained([*(replace(problem, parameters=each) for each in rougher), problem], start)


def less_force(problem: gp.GraspProblem, start: gp.GraspStart) -> gp.Grasp:
    """Continuation in the weights, from w_F/w_C a thousand times larger."""
    heavier = [
        replace(problem.parameters, force_weight=factor * problem.parameters.force_weight) for factor in (1e3, 30)
    ]
    return chained([*(replace(problem, parameters=each) for each in heavier), problem], start)


def least_squares_first(problem: gp.GraspProblem, start: gp.GraspStart) -> gp.Grasp:
    """Phase one by least squares on the violations instead of SQP."""
    return single(problem, start, phase_one=True)


def prepared(problem: gp.GraspProblem, start: gp.GraspStart) -> gp.Grasp:
    """The start moved along the synergies first, then both phases."""
    try:
        return by_sqp(problem, prepare_start(problem, start).start)
    except (ValueError, np.linalg.LinAlgError):
        return single(problem, start)


def trust_region(hessian: BFGS | SR1) -> Variant:
    """Phase two by the trust-region interior-point method with a chosen Hessian, from the prepared start."""

    def solve(problem: gp.GraspProblem, start: gp.GraspStart) -> gp.Grasp:
        try:
            start = prepare_start(problem, start).start
        except (ValueError, np.linalg.LinAlgError):
            return single(problem, start)
        grasp_program = program.GraspProgram(problem, start.palm_pose)
        z = grasp_program.pack(start.joint_angles, start.palm_pose, start.delta_sigma)
        nlp = grasp_program.build("two", grasp_program.objective_scale(z))

        def constraint(function: Callable[..., tuple[np.ndarray, np.ndarray]], upper: float) -> NonlinearConstraint:
            return NonlinearConstraint(
                lambda z: function(z)[0], 0.0, upper, jac=lambda z: function(z)[1], hess=type(hessian)()
            )

        found = minimize(
            nlp.objective,
            np.clip(z, nlp.lower, nlp.upper),
            jac=True,
            hess=hessian,
            method="trust-constr",
            bounds=np.column_stack([nlp.lower, nlp.upper]),
            constraints=[constraint(nlp.equality, 0.0), constraint(nlp.inequality, np.inf)],
            options={"maxiter": 200, "gtol": 1e-8, "xtol": 1e-10},
        )
        layout, x = grasp_program.evaluator.layout, found.x * grasp_program.scale
        q = np.clip(x[layout.joints], problem.hand.lower, problem.hand.upper)
        report = SearchReport(seed=0, iterations=int(found.nit), evaluations=grasp_program.evaluations)
        return gp.Grasp(problem, q, grasp_program.evaluator.palm_pose(x), x[layout.displacement], search=report)

    return solve


VARIANTS: dict[str, Variant] = {
    "phase two alone": lambda p, s: single(p, s, phase_one=False),
    "phase one, then two": by_sqp,
    "prepared along the synergies, then both": prepared,
    "phase one by least squares, then two": least_squares_first,
    "both; without scaling of the variables": without_scaling,
    "both; tolerance 1e-5": lambda p, s: by_sqp(p, s, tolerance=1e-5),
    "both; tolerance 1e-11": lambda p, s: by_sqp(p, s, tolerance=1e-11),
    "both; at most 400 iterations": lambda p, s: by_sqp(p, s, max_iterations=400),
    "both; from the mean posture": lambda p, s: by_sqp(p, replace(s, joint_angles=p.synergies.mean)),
    "prepared; trust-constr with BFGS Hessians": trust_region(BFGS()),
    "prepared; trust-constr with SR1 Hessians": trust_region(SR1()),
    "continuation in n_s": fewer_synergies,
    "continuation in compliance": less_compliance,
    "continuation in friction": less_friction,
    "continuation in weights": less_force,
}


def main() -> None:
    """Run every variant and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=24)
    parser.add_argument("--synergy-set", default="santello")
    parser.add_argument("--counts", default="1,2,3,5,15")
    arguments = parser.parse_args()
    hand = gp.load_hand()
    print(f"{arguments.starts} random starts each; synergy set {arguments.synergy_set}; y task")
    print(
        "\n| n_s | variant | feasible | iterations | evaluations per feasible start | s per feasible start | best z |"
    )
    print("|---|---|---|---|---|---|---|")
    for n_s in (int(text) for text in arguments.counts.split(",")):
        problem = gp.GraspProblem.paper(hand, gp.Cylinder(), n_synergies=n_s, synergy_set=arguments.synergy_set)
        for name, variant in VARIANTS.items():
            rng = np.random.default_rng(0)
            starts = [gp.random_start(problem, rng) for _ in range(arguments.starts)]
            began = time.process_time()
            grasps = [variant(problem, start) for start in starts]
            spent = time.process_time() - began
            good = [grasp for grasp in grasps if grasp.feasible]
            evaluations = sum(grasp.search.evaluations for grasp in grasps if grasp.search)
            iterations = [grasp.search.iterations for grasp in good if grasp.search]
            cells = [
                f"{n_s}",
                name,
                f"{len(good)}/{len(grasps)}",
                f"{statistics.median(iterations):.0f}" if good else "–",
                f"{evaluations / len(good):.0f}" if good and "continuation" not in name else "–",
                f"{spent / len(good):.2f}" if good else "–",
                f"{min(grasp.objective for grasp in good):.2e}" if good else "–",
            ]
            print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
