"""Hands other than the DLR/HIT II: the Allegro hand of example-robot-data and a tendon-driven one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.records.grasp_record import grasp_record

ROOT = Path(__file__).parents[2]
QUICK = gp.PlannerOptions(starts=25, enough=1)
# These tests are about contacts and forces alone: where links have to keep clear too, that is left out.
OBJECTS = (
    "sphere:radius=0.035",
    "cylinder:radius=0.03",
    "box:x=0.06,y=0.05,z=0.08",
    "capsule:radius=0.028",
    "ellipsoid:x=0.03,y=0.035,z=0.05",
)


@pytest.fixture(scope="module")
def allegro():
    return gp.load_hand("allegro_right")


@pytest.fixture(scope="module")
def tendon():
    return gp.load_hand("tendon_hand")


def test_library_lists_them():
    assert {"allegro_right", "tendon_hand", "dlr_hit_ii_right", "dlr_hit_ii_left"} <= set(gp.hand_library())


def test_allegro_description(allegro):
    """16 free joints, tips of 12 mm where the URDF has its spheres, and no file of its own but the description."""
    assert allegro.n_joints == 16
    assert np.array_equal(allegro.coupling.sum(axis=0), np.ones(16))
    spheres = {
        allegro.model.frames[entry.parentFrame].name: entry.geometry.radius
        for entry in allegro.collision_model.geometryObjects
        if "tip" in entry.name
    }
    for frame in allegro.contact_frames("sphere"):
        assert frame.radius == pytest.approx(spheres[frame.frame])
    assert not list((ROOT / "urdf" / "allegro").rglob("*.stl"))


def test_allegro_fingers_spread_as_described(allegro):
    """Remark 1: along the order neighbours spread when the angles fall."""
    order = allegro.description.remark1
    assert order is not None and order.sign == -1
    frames = [allegro.model.getFrameId(f"link_{k}.0_tip") for k in (3, 7, 11)]
    data = allegro.model.createData()

    def gaps(angles):
        bent = {f"joint_{k}.0": 0.8 for k in (1, 5, 9)}
        q = allegro.posture(dict(zip(order.abduction_order, angles, strict=True)) | bent)
        pin.framesForwardKinematics(allegro.model, data, allegro.full_configuration(q))
        tips = np.array([data.oMf[frame].translation for frame in frames])
        return np.linalg.norm(np.diff(tips, axis=0), axis=1)

    assert (gaps((0.1, 0.0, -0.1)) > gaps((0.0, 0.0, 0.0))).all()


def test_allegro_synergies(allegro):
    """PCA over the hand's own grasps: complete, orthonormal, and by falling variance."""
    space = allegro.synergies()
    assert space.basis.shape == (16, 16)
    np.testing.assert_allclose(space.basis.T @ space.basis, np.eye(16), atol=1e-9)
    assert (np.diff(space.variance) <= 0.0).all()
    assert space.explained_variance()[4] > 0.7


@pytest.mark.slow
@pytest.mark.parametrize("n_synergies", [16, 5])
@pytest.mark.parametrize("text", OBJECTS)
def test_allegro_plans(allegro, text, n_synergies):
    problem = gp.GraspProblem.paper(hand=allegro, grasp_object=gp.parse_object(text), n_synergies=n_synergies)
    grasp = gp.plan_grasp(problem, seed=1, options=QUICK)
    assert grasp.feasible, grasp.verdict


def test_tendon_hand_is_underactuated(tendon):
    """Seven independent joints, four motors; a stiffness for each joint; one joint mimics another backwards."""
    space = tendon.synergies()
    assert (tendon.n_joints, space.n_synergies) == (7, 4)
    compliance = dict(zip(tendon.joint_names, tendon.joint_compliance, strict=True))
    assert compliance["thumb_proximal"] == 1.25 and compliance["left_distal"] == 0.5
    right, left = (tendon.model.idx_vs[tendon.model.getJointId(f"{side}_turn")] for side in ("right", "left"))
    assert tendon.coupling[right, 0] == -tendon.coupling[left, 0] == -1.0


def test_tendon_synergies_are_those_of_the_pulleys(tendon):
    """Pulling a tendon of the free hand with tension t moves the joints by r t / k, and others not at all."""
    space = tendon.synergies()
    column = dict(zip(tendon.joint_names, space.basis[:, 0], strict=True))
    assert column["thumb_proximal"] / column["thumb_distal"] == pytest.approx((0.010 / 0.8) / (0.008 / 2.0))
    assert {name for name, value in column.items() if value != 0.0} == {"thumb_proximal", "thumb_distal"}


def test_compliance_of_the_hand_is_the_default(tendon):
    """Without other numbers a problem takes C_q from the hand; numbers given replace it."""
    sphere = gp.Sphere()
    own = gp.GraspProblem.paper(hand=tendon, grasp_object=sphere, n_synergies=4)
    np.testing.assert_array_equal(own.joint_compliance, tendon.joint_compliance)
    given = gp.GraspProblem.paper(
        hand=tendon, grasp_object=sphere, n_synergies=4, parameters=gp.GraspParameters(joint_compliance=0.2)
    )
    np.testing.assert_array_equal(given.joint_compliance, np.full(7, 0.2))
    with pytest.raises(gp.InvalidValueError, match=r"shape \(7,\)"):
        parameters = gp.GraspParameters(joint_compliance=(0.1, 0.2))
        _ = gp.GraspProblem.paper(
            hand=tendon, grasp_object=sphere, n_synergies=4, parameters=parameters
        ).joint_compliance
    with pytest.raises(gp.InvalidValueError, match="from 1 to 4"):
        gp.GraspProblem.paper(hand=tendon, grasp_object=sphere, n_synergies=5)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("text", ["sphere:radius=0.035,mass=0.1", "cylinder:radius=0.03,mass=0.1"])
def test_tendon_plans(tendon, text, seed):
    """Four motors hold an object with three fingertips, by a reference they can give: tendons only pull."""
    problem = gp.GraspProblem.paper(hand=tendon, grasp_object=gp.parse_object(text), n_synergies=4)
    grasp = gp.plan_grasp(problem, seed=seed, options=QUICK)
    assert grasp.feasible, grasp.verdict
    bent = problem.synergies.mean + problem.synergies.basis @ grasp.sigma
    np.testing.assert_allclose(bent - tendon.joint_compliance * grasp.bending_torques, grasp.joint_angles, atol=1e-6)
    again = gp.grasp_from_record(grasp_record(grasp))
    np.testing.assert_allclose(again.forces, grasp.forces, rtol=1e-9)
    assert (grasp.sigma[:3] > 0.0).all()


def test_committed_files_are_what_the_script_writes():
    run = [sys.executable, str(ROOT / "scripts" / "make_tendon_hand.py"), "--check"]
    assert subprocess.run(run, check=False, env={"PYTHONPATH": str(ROOT)}).returncode == 0


def test_a_urdf_of_a_package_that_is_not_there(tmp_path):
    text = (ROOT / "urdf" / "allegro" / "allegro_right.toml").read_text(encoding="utf-8")
    for wrong, reason in (("robots/no_such.urdf", "No such file"), ("../../secret.urdf", "no path within")):
        path = tmp_path / "hand.toml"
        path.write_text(text.replace("robots/allegro_hand_description/urdf/allegro_right_hand.urdf", wrong))
        with pytest.raises(gp.FileFormatError, match=reason):
            gp.load_hand(path)


def test_compliance_table_is_checked(tmp_path, tendon):
    text = (tendon.folder / "tendon_hand.toml").read_text(encoding="utf-8")
    text = text.replace('"tendon_hand.urdf"', f'"{tendon.folder / "tendon_hand.urdf"}"')
    path = tmp_path / "hand.toml"
    path.write_text(text.replace("thumb_distal = 0.5\n", ""))
    with pytest.raises(gp.InvalidValueError, match="thumb_distal"):
        _ = gp.load_hand(path).joint_compliance
    path.write_text(text.replace("thumb_distal = 0.5\n", "thumb_dist = 0.5\n"))
    with pytest.raises(gp.NameNotFoundError, match="did you mean 'thumb_distal'"):
        _ = gp.load_hand(path).joint_compliance
