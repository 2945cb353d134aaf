"""The benchmark's random problems: the same results whoever plans them, also without the optional extras."""

import subprocess
import sys
from dataclasses import replace

import pytest

import grasp_planner as gp
from grasp_planner.cli.bench_stages import STAGES, stage_names
from grasp_planner.evaluation.state import StateEvaluator
from grasp_planner.studies.benchmark import evaluation_speed, plan_cases
from grasp_planner.studies.benchmark_problems import BenchmarkCase
from grasp_planner.studies.benchmark_stages import batch_speed, batch_speeds, grasp_times, optimality_speed, throughput


def untimed(results):
    return [replace(result, cpu_s=0.0, cpu_per_grasp_s=0.0) for result in results]


def test_results_do_not_depend_on_the_number_of_workers():
    cases = [BenchmarkCase(seed, 15) for seed in range(4)]
    one, two = (plan_cases(cases, cpu_limit_s=60.0, enough=1, workers=workers) for workers in (1, 2))
    results = untimed(two)
    assert results == untimed(one)
    assert [result.case for result in results] == cases
    assert any(result.feasible for result in results)


def test_no_state_is_timed_twice(monkeypatch):
    """What follows from a posture is kept while it stays the same: a second call would measure that."""
    seen, evaluate = [], StateEvaluator.evaluate

    def noting(evaluator, x):
        seen.append(x.tobytes())
        return evaluate(evaluator, x)

    monkeypatch.setattr(StateEvaluator, "evaluate", noting)
    speed = evaluation_speed("dlr_hit_ii_right", 3, clearance=True, states=2, repeats=4)
    assert len(seen) == len(set(seen)) == 8
    assert speed.ratio == speed.median_ms / speed.kinematics_ms > 1.0


def test_a_batch_counts_what_it_takes():
    problem = BenchmarkCase(0, 15).problem()
    speed = batch_speed("plain", problem, 8)
    assert speed.taken == 32
    assert 0 < speed.found <= 32
    assert 0.0 < speed.evaluation_us < speed.iteration_us
    assert speed.ms_per_found > 0.0


@pytest.mark.slow
def test_every_growth_is_measured():
    asked = [speed.asked for speed in batch_speeds("dlr_hit_ii_right", 3, widths=(1, 2))]
    assert asked[:2] == ["plain", "plain"]
    assert len(set(asked)) == len(asked) - 1 == 6


def test_both_solvers_start_where_phase_two_does():
    found = optimality_speed(BenchmarkCase(0, 15))
    assert found is not None
    assert found.verification_ms > 0.0
    for run in (found.slsqp, found.newton):
        assert run.iterations > 0 < run.seconds
        assert run.violation < 1e-6
    assert found.newton.residual < max(found.slsqp.residual, 1e-6)
    assert found.newton.objective <= found.slsqp.objective + 1e-2


def test_times_until_there_are_grasps_are_measured():
    times = grasp_times(BenchmarkCase(0, 15))
    assert 0.0 < times.point.seconds < times.several.seconds
    assert times.first.seconds > 0.0
    assert 0.0 < times.several.force <= times.point.force


def test_stages_are_named_one_by_one():
    assert stage_names(["optima"]) == ("optima",)
    assert stage_names(["all"]) == STAGES
    with pytest.raises(gp.NameNotFoundError, match="stage 'all'"):
        stage_names(["optima", "all"])


def test_throughput_counts_the_problems_once():
    cases = [BenchmarkCase(seed, 15) for seed in range(2)]
    rate = throughput(cases, 1, solver="none", enough=2, cpu_limit_s=10.0)
    assert (rate.solver, rate.enough, rate.workers, rate.problems) == ("none", 2, 1, 2)
    assert 0 < rate.feasible <= 4
    assert rate.seconds > 0.0


def test_studies_load_without_the_extras():
    missing = "import sys; sys.modules.update(pyarrow=None, duckdb=None, mujoco=None);"
    modules = ("benchmark", "synergy_study", "synergy_study_page", "study_statistics")
    code = missing + "".join(f"import grasp_planner.studies.{name};" for name in modules)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
