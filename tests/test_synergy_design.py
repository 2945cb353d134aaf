"""Sets for a number of motors: what they are made from, that they reach it, and the command."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.main import main
from grasp_planner.exceptions import InvalidValueError
from grasp_planner.objects.random_objects import CLOSED_FORMS, MESHES, random_object
from grasp_planner.studies.benchmark_problems import BenchmarkCase
from grasp_planner.synergy_design import training as jobs
from grasp_planner.synergy_design.design import FIRST_SEED, Design, Progress, synergies_for_motors
from grasp_planner.synergy_design.training import KINDS, PlanJob, Trainer, Training, fully_actuated, object_scale


@pytest.mark.parametrize("kind", [*CLOSED_FORMS, *MESHES])
def test_random_objects_are_in_size_for_a_hand_and_the_same_from_the_same_seed(kind, tmp_path):
    things = [random_object(kind, np.random.default_rng(seed), tmp_path) for seed in (3, 3, 4)]
    assert things[0] == things[1] != things[2]
    for thing in things:
        assert 0.035 < min(thing.mesh.extents) < 0.095
        assert thing.distances(np.zeros(3)) < 0.0


@pytest.mark.parametrize("seed", range(5))
def test_hulls_are_convex_and_turned_bodies_solids(seed):
    hull, turned = (MESHES[kind](np.random.default_rng(seed)) for kind in ("hull", "turned"))
    assert hull.is_convex and hull.is_watertight
    assert turned.is_watertight and turned.volume > 0.0
    radii = np.linalg.norm(turned.vertices[:, :2], axis=1)
    assert radii.max() <= 0.045 + 1e-12
    assert trimesh.convex.convex_hull(turned).volume > 1.001 * turned.volume


def test_a_training_problem_is_the_default_problem_of_its_seed(right, tmp_path):
    training = Training("dlr_hit_ii_right", tmp_path, scale=0.9)
    space = right.synergies("native_clear").truncated(2)
    problem = training.problem(1, space, right)
    assert problem == training.problem(1, space)
    assert problem.n_synergies == 2 and problem.synergies == space
    assert problem.loads.active and problem.clearance == gp.ClearanceOptions()
    whole = replace(training, scale=1.0).problem(1, space, right).grasp_object
    assert problem.grasp_object.radius == pytest.approx(0.9 * whole.radius)
    assert {training.kind(seed) for seed in range(len(KINDS))} == set(KINDS)


def test_objects_suit_the_hand(right, tmp_path):
    assert object_scale(right) == pytest.approx(1.0, abs=0.1)
    with pytest.raises(InvalidValueError, match="scale"):
        Training("dlr_hit_ii_right", tmp_path, scale=-1.0)


@pytest.mark.parametrize(("motors", "objects", "field"), [(0, 4, "motors"), (16, 4, "motors"), (1, 1, "objects")])
def test_numbers_out_of_range_are_named(tmp_path, motors, objects, field):
    with pytest.raises(InvalidValueError, match=field):
        synergies_for_motors(Training("dlr_hit_ii_right", tmp_path), motors, objects=objects)


@pytest.mark.slow
def test_a_set_for_two_motors_grasps_what_it_was_made_from(right, tmp_path):
    told = []
    training = Training("dlr_hit_ii_right", tmp_path)
    space, grasped = synergies_for_motors(training, 2, objects=2, workers=2, report=told.append)
    assert space.n_synergies == 2 and space.joint_names == right.joint_names
    np.testing.assert_allclose(space.basis.T @ space.basis, np.eye(2), atol=1e-12)
    assert grasped >= 1
    found = [
        gp.plan_grasp(
            training.problem(FIRST_SEED + k, space, right), seed=k, options=gp.PlannerOptions(starts=5, enough=1)
        )
        for k in range(2)
    ]
    assert sum(grasp.feasible for grasp in found) >= grasped
    stages = [each for each in told if isinstance(each, Progress)]
    assert all(0 <= each.done <= each.total for each in stages)
    assert any("n_s = 2" in each for each in told if isinstance(each, str))


@pytest.mark.parametrize(("outcomes", "tried"), [("------", 3), ("--+------", 9)])
def test_an_object_that_no_start_grasps_is_given_up(tmp_path, monkeypatch, outcomes, tried):
    """After three starts without a grasp; where one was found, the search goes on."""
    said = []

    def plan(problem, *, seed, options, result_callback, cancel):
        for outcome in outcomes:
            if cancel():
                break
            said.append(outcome)
            result_callback(SimpleNamespace(feasible=outcome == "+"))

    monkeypatch.setattr(jobs, "plan_grasp", plan)
    monkeypatch.setattr(jobs.compact, "free_grasp", lambda grasp: grasp)
    trainer = Trainer(Training("dlr_hit_ii_right", tmp_path, patience=3))
    found = trainer(PlanJob(1, fully_actuated(trainer.hand), 25, 3))
    assert len(said) == tried and len(found) == outcomes.count("+")


def test_objects_that_the_free_hand_does_not_grasp_make_no_set(tmp_path, monkeypatch):
    monkeypatch.setattr(Trainer, "__call__", lambda trainer, job: [])
    with pytest.raises(InvalidValueError, match="objects"):
        Design(Training("dlr_hit_ii_right", tmp_path), range(2))


def test_every_joint_of_the_free_hand_is_a_synergy_within_its_limits(hand):
    space = fully_actuated(hand)
    np.testing.assert_array_equal(space.basis, np.eye(hand.n_joints))
    assert (space.mean >= hand.lower).all() and (space.mean <= hand.upper).all()


@pytest.mark.slow
def test_the_command_writes_a_set_that_plan_takes(tmp_path):
    out, result = tmp_path / "two.csv", tmp_path / "grasp.json"
    words = f"synergies design --motors 2 --objects 2 --out {out}".split()
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    space = gp.load_synergies(out)
    assert space.name == "motors_2" and "not human data" in space.provenance
    assert (
        "synergies design --hand dlr_hit_ii_right --motors 2 --objects 2 --seed 20000 --patience 6 --scale"
        in space.provenance
    )
    words = f"plan --synergy-set {out} --synergies 2 --object sphere:radius=0.038 --starts 2 --json {result}".split()
    CliRunner().invoke(main, words)
    assert gp.grasp_from_record(gp.read_grasp_record(result)).problem.synergies == space.truncated(2)


@pytest.mark.parametrize(
    ("words", "field"),
    [
        ("--motors 0", "motors"),
        ("--motors 40", "motors"),
        ("--motors 1 --objects 0", "objects"),
        ("--motors 1 --scale 0", "scale"),
        ("--motors 1 --patience 0", "patience"),
    ],
)
def test_bad_words_get_one_line(tmp_path, words, field):
    done = CliRunner().invoke(main, ["synergies", "design", "--out", str(tmp_path / "set.csv"), *words.split()])
    assert done.exit_code == 2 and field in done.output
    assert not (tmp_path / "set.csv").exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dlr_hit_ii_right", "allegro_right"])
@pytest.mark.parametrize("motors", [1, 2, 3])
def test_the_sets_for_exactly_so_many_motors_grasp_what_they_have_not_seen(name, motors):
    space = gp.load_hand(name).synergies(f"motors_{motors}")
    assert space.n_synergies == motors and f"--hand {name} --motors {motors}" in space.provenance
    cases = [
        BenchmarkCase(seed, motors, name, kind, f"motors_{motors}", clearance=True, loads=True)
        for seed, kind in enumerate(("cylinder", "sphere", "box", "cylinder"))
    ]
    options = gp.PlannerOptions(enough=1)
    found = [gp.plan_grasp(case.problem(), seed=case.seed, options=options).feasible for case in cases]
    assert sum(found) >= 3
