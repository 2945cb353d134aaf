"""Contacts beside the pads: where the skin is round, found by a short search, kept in the grasp's file."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.batch import GraspCase, RunRows, run_batch
from grasp_planner.cli.main import main
from grasp_planner.collision.link_shapes import link_shapes
from grasp_planner.evaluation.clearance import _thinned
from grasp_planner.hand.contact_frame import SKIN, find_contact_frame
from grasp_planner.hand.hull_fit import surface_distance
from grasp_planner.hand.loading import LoadedHand, loaded_hand
from grasp_planner.hand.skin import Skin, with_contact_sets
from grasp_planner.planning.side_contacts import moved_contacts, said_of, with_planned_contacts
from grasp_planner.records.grasp_files import parse_grasp_record
from grasp_planner.records.grasp_record import grasp_record
from grasp_planner.viewer.planning import _content, _grasp

from .small_hands import write_hand


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write_hand(tmp_path_factory.mktemp("flat"), "flat_pads")


@pytest.fixture(scope="module")
def problem(path):
    loaded = loaded_hand(path)
    return gp.GraspProblem(loaded.hand, gp.parse_object(loaded.first_object))


@pytest.fixture(scope="module")
def moved(problem):
    return moved_contacts(problem, np.random.default_rng(0))


def solids_of(hand, frame):
    return [e for e in hand.collision_model.geometryObjects if int(e.parentJoint) == frame.joint_id]


def test_a_hand_with_a_tendon_begins_with_a_ball(problem):
    assert problem.hand.tendons is not None
    assert isinstance(problem.grasp_object, gp.Sphere)


def test_the_pads_hold_nothing_and_their_sides_do(problem, moved):
    """Every contact that is moved is at the skin, all around its patch, and turned off the pad's normal."""
    assert moved is not problem and moved.grasp_object == problem.grasp_object
    turned = [float(np.array(a.normal) @ b.normal) for a, b in zip(problem.frames, moved.frames, strict=True)]
    assert min(turned) < np.cos(problem.frames[0].patch.side)
    for frame in moved.frames:
        normal, across = np.array(frame.patch.normal), np.array(frame.patch.across)
        along = np.cross(across, normal)
        for bend in np.linspace(-frame.patch.bend, frame.patch.bend, 5):
            for side in np.linspace(-frame.patch.side, frame.patch.side, 3):
                bent = np.cos(bend) * normal + np.sin(bend) * along
                touching = np.cos(side) * bent + np.sin(side) * across
                point = np.array(frame.centre) + frame.radius * touching
                assert surface_distance(solids_of(moved.hand, frame), point) < SKIN
    (line,) = said_of(problem.hand, moved.hand)
    assert all(frame.name in line for frame in moved.frames)
    assert said_of(problem.hand, problem.hand) == ()


def test_what_is_moved_is_not_moved_again(moved):
    assert moved_contacts(moved, np.random.default_rng(1)) is moved


def test_a_margin_takes_up_the_rims_of_hulls(problem):
    hulls = [shape for shape in link_shapes(problem.hand) if shape.fitted and shape.geometry is not None]
    assert hulls
    for shape in hulls:
        assert _thinned(shape, 1.0).rim == 0.0
        thin = _thinned(shape, 0.25 * shape.rim)
        assert thin.rim == pytest.approx(0.75 * shape.rim)
        assert thin.geometry.getSweptSphereRadius() == pytest.approx(thin.rim)


def test_contacts_of_a_description_stay(problem):
    paper = gp.GraspProblem.paper(gp.load_hand(), gp.Sphere())
    assert moved_contacts(paper, np.random.default_rng(0)) is paper
    loose = gp.GraspProblem(problem.hand, problem.grasp_object, clearance=gp.ClearanceOptions(tip_patch=False))
    assert moved_contacts(loose, np.random.default_rng(0)) is loose


def test_the_skin_around_a_normal(problem):
    """On the pad the widest patch is about as wide as the one that was derived; of the whole tip a ball is told."""
    hand, frame = problem.hand, problem.frames[0]
    skin = Skin(hand, frame)
    found = find_contact_frame(hand.model, frame.name, skin.about(np.array(frame.normal)))
    assert np.array(found.normal) @ frame.normal == pytest.approx(1.0, abs=1e-9)
    assert found.patch.bend * found.patch.side >= 0.5 * frame.patch.bend * frame.patch.side
    whole = find_contact_frame(hand.model, frame.name, skin.whole())
    assert whole.patch.bend == whole.patch.side > 0.6
    with pytest.raises(gp.InvalidValueError, match="patch"):
        Skin(hand, gp.load_hand("dlr_hit_ii_right").contact_frames()[0])


def test_a_file_keeps_the_contacts_that_were_moved(path, moved):
    """Also where the hand is given, as it comes from its URDF."""
    grasp = gp.Grasp(moved, 0.5 * (moved.hand.lower + moved.hand.upper), pin.exp6(np.arange(6.0)), np.zeros(1))
    text = gp.grasp_json(grasp).encode()
    for given in (None, gp.load_hand(path)):
        again = gp.grasp_from_record(parse_grasp_record(text, "here"), given)
        assert again.problem.frames == moved.frames
        assert again.problem.frames != gp.load_hand(path).contact_frames()
        assert grasp_record(again).hand_source == grasp_record(grasp).hand_source


def test_the_written_description_has_the_moved_contacts(path, moved, tmp_path):
    """The TOML stands for what is planned: its contacts are those that the planner moves to, and stay."""
    file = tmp_path / "written.toml"
    answer = CliRunner().invoke(main, ["hand", "check", str(path), "--toml", str(file)])
    assert answer.exit_code == 0, answer.output
    assert "moved beside the pads" in answer.output
    written = gp.load_hand(file)
    assert written.description.contact_sets == moved.hand.description.contact_sets
    again = gp.GraspProblem(written, moved.grasp_object)
    assert moved_contacts(again, np.random.default_rng(0)) is again


def test_the_description_of_a_hand_whose_pads_serve_is_the_derived_one(tmp_path):
    file = tmp_path / "written.toml"
    urdf = write_hand(tmp_path, "mesh_links")
    answer = CliRunner().invoke(main, ["hand", "check", str(urdf), "--toml", str(file)])
    assert answer.exit_code == 0, answer.output
    assert "moved beside the pads" not in answer.output
    assert gp.load_hand(file).description.contact_sets == gp.load_hand(urdf).description.contact_sets


def test_a_hand_with_too_few_contacts_is_written_as_it_is(path, problem):
    """Of two hard contacts no grasp is made; the description is written all the same, to be corrected."""
    contacts = dict(list(problem.hand.description.contact_sets["sphere"].items())[:2])
    hand = with_contact_sets(problem.hand, {"sphere": contacts})
    assert with_planned_contacts(LoadedHand(hand, loaded_hand(path).first_object)) is hand


@pytest.mark.slow
def test_a_batch_moves_contacts(path, problem, moved, tmp_path):
    """A case of the bare URDF is planned with the moved contacts, and so are those its row opens with."""
    settings = {"enough": 1}
    case = GraspCase(hand=str(path), object=problem.grasp_object.text, n_synergies=1, settings=settings)
    run_batch([case], tmp_path / "run", workers=1)
    grasp, _ = RunRows(tmp_path / "run", row=0).grasp()
    assert grasp.feasible
    assert grasp.problem.frames == moved.frames


@pytest.mark.slow
def test_every_door_of_the_planner_moves_contacts(problem):
    """What Python plans has the moved contacts, from the same seed; what the page is sent has them too."""
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))
    assert grasp.feasible
    assert grasp.problem.frames == moved_contacts(problem, np.random.default_rng(0)).frames != problem.frames
    assert _grasp(problem, _content(grasp)).problem.frames == grasp.problem.frames


@pytest.mark.slow
def test_planned_from_a_bare_urdf_and_opened_again(path, tmp_path):
    """The command says what it moved; the file opens with those contacts, and is feasible by itself."""
    file = tmp_path / "grasp.json"
    answer = CliRunner().invoke(main, ["plan", "--hand", str(path), "--enough", "1", "--json", str(file), "--quiet"])
    assert answer.exit_code == 0, answer.output
    assert "moved beside the pads" in answer.stderr
    again = gp.grasp_from_record(gp.read_grasp_record(file))
    assert again.feasible
    assert again.problem.hand.description.contact_sets != gp.load_hand(path).description.contact_sets
