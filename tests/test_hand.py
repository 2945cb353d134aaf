"""Loading hands: names, coupling, limits; and every way a description or a URDF can be wrong."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.hand.description import MAX_DESCRIPTION_BYTES

FOLDER = Path(__file__).parents[1] / "urdf" / "dlr_hit_ii"


@pytest.fixture
def copy(tmp_path):
    """A copy of the right hand's files that a test may spoil."""
    shutil.copytree(FOLDER, tmp_path / "hand")
    return tmp_path / "hand"


def spoil(copy, old, new, name="dlr_hit_ii_right.toml"):
    path = copy / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return copy / "dlr_hit_ii_right.toml"


def test_both_hands_come_with_the_package():
    assert {"dlr_hit_ii_right", "dlr_hit_ii_left"} <= set(gp.hand_library())


def test_distal_joints_follow_the_proximal_ones(hand, rng):
    q = rng.random(hand.n_joints)
    full = dict(zip(list(hand.model.names)[1:], hand.full_configuration(q), strict=True))
    for finger in ("thumb", "index", "middle", "ring", "little"):
        assert full[f"{finger}_dip"] == full[f"{finger}_pip"] == q[hand.joint_index(f"{finger}_pip")]


def test_limits_are_those_of_the_data_sheet(hand):
    degrees = np.degrees(np.stack([hand.lower, hand.upper], axis=1)).reshape(5, 3, 2)
    np.testing.assert_allclose(degrees, np.tile([[-15, 15], [0, 85], [0, 65]], (5, 1, 1)), atol=1e-3)


def test_postures_by_joint_name(right):
    q = right.posture({"index_mcp": 0.3})
    assert q[right.joint_index("index_mcp")] == 0.3
    assert np.count_nonzero(q) == 1
    with pytest.raises(gp.NameNotFoundError, match="index_mcp"):
        right.posture({"index_mpc": 0.3})


def test_contact_links_are_the_fingertips(right):
    for name in ("point", "sphere"):
        for frame in right.contact_frames(name):
            assert frame.link.startswith(frame.name)


def test_unknown_names_list_what_exists(right):
    for call, known in (
        (lambda: gp.load_hand("dlr_hit_ii_rigth"), "dlr_hit_ii_right"),
        (lambda: right.contact_frames("flat"), "point"),
        (lambda: right.synergies("freud"), "native"),
    ):
        with pytest.raises(gp.NameNotFoundError) as caught:
            call()
        assert known in caught.value.known
        assert known in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "error", "part"),
    [
        ("[palm]", "[palm", gp.FileFormatError, "TOML"),
        ("name = ", "nme = ", gp.FileFormatError, "name"),
        ("normal = [1.0, 0.0, 0.0]", "normal = [0.0, 0.0, 0.0]", gp.InvalidValueError, "palm.normal"),
        ("normal = [1.0, 0.0, 0.0]", "normal = [nan, 0.0, 0.0]", gp.FileFormatError, "palm.normal"),
        ("joint = 0.1", "joint = -0.1", gp.FileFormatError, "compliance.joint"),
        ('link = "palm"', 'link = "plam"', gp.NameNotFoundError, "palm"),
        ('link = "palm"', 'link = "index_distal"', gp.InvalidValueError, "fixed to the root"),
        ('"thumb_abd", ', '"thumb_abdu", ', gp.NameNotFoundError, "thumb_abd"),
        ('"thumb_abd", ', "", gp.InvalidValueError, "thumb_abd"),
        ('"thumb_abd", ', '"thumb_dip", "thumb_abd", ', gp.InvalidValueError, "mimic"),
        ("dlr_hit_ii_right.urdf", "missing.urdf", gp.FileFormatError, "No such file"),
    ],
)
def test_spoiled_descriptions_are_one_clear_error(copy, old, new, error, part):
    with pytest.raises(error, match=part) as caught:
        gp.load_hand(spoil(copy, old, new))
    assert "\n" not in str(caught.value)


def test_a_missing_contact_frame_names_those_that_exist(copy):
    hand = gp.load_hand(spoil(copy, '"thumb_tip"', '"thumb_top"'))
    with pytest.raises(gp.NameNotFoundError) as caught:
        hand.contact_frames("point")
    assert "thumb_tip" in caught.value.known


def test_a_hand_without_contact_frames_can_be_loaded_but_not_planned_with(copy):
    path = copy / "dlr_hit_ii_right.toml"
    lines = path.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("[contact_sets"))
    end = next(i for i, line in enumerate(lines) if line.startswith("[synergies]"))
    path.write_text("\n".join(lines[:start] + lines[end:]))
    hand = gp.load_hand(path)
    with pytest.raises(gp.InvalidValueError, match="contact_sets"):
        gp.GraspProblem.paper(hand, gp.Cylinder())


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("<robot", "<!DOCTYPE x [<!ENTITY a 'b'>]><robot", "document type"),
        ("</robot>", "", "valid XML"),
        ('<mimic joint="index_pip"', '<mimic joint="nobody"', "does not exist"),
    ],
)
def test_spoiled_urdfs_are_one_clear_error(copy, old, new, part):
    toml = spoil(copy, old, new, "dlr_hit_ii_right.urdf").with_name("dlr_hit_ii_right.toml")
    with pytest.raises(gp.FileFormatError, match=part) as caught:
        gp.load_hand(toml)
    assert "\n" not in str(caught.value)


def test_a_floating_joint_is_refused(copy):
    urdf = copy / "dlr_hit_ii_right.urdf"
    text = urdf.read_text()
    urdf.write_text(text.replace('name="index_abd" type="revolute"', 'name="index_abd" type="floating"', 1))
    with pytest.raises(gp.FileFormatError, match="index_abd"):
        gp.load_hand(copy / "dlr_hit_ii_right.toml")


def test_huge_descriptions_are_not_read(copy):
    path = copy / "dlr_hit_ii_right.toml"
    path.write_text("#" * (MAX_DESCRIPTION_BYTES + 1))
    with pytest.raises(gp.FileFormatError, match="larger than"):
        gp.load_hand(path)


def test_binary_files_are_not_text(copy):
    path = copy / "dlr_hit_ii_right.toml"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(gp.FileFormatError, match="UTF-8"):
        gp.load_hand(path)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"n_synergies": 0}, "n_synergies"),
        ({"n_synergies": 16}, "n_synergies"),
        ({"n_synergies": 2.5}, "n_synergies"),
        ({"n_synergies": True}, "n_synergies"),
        ({"tasks": ()}, "tasks"),
        ({"tasks": (gp.twist_task([1, 0, 0, 0, 0, 0]),), "n_synergies": 3}, "n_synergies"),
    ],
)
def test_bad_problems_name_the_field(right, arguments, field):
    with pytest.raises(gp.InvalidValueError) as caught:
        gp.GraspProblem.paper(right, gp.Cylinder(), **arguments)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("friction", 0.0),
        ("friction", -0.1),
        ("friction", float("nan")),
        ("structural_compliance", 0.0),
        ("joint_compliance", -1.0),
        ("joint_compliance", (0.1, float("nan"))),
        ("contact_stiffness", -1.0),
        ("force_weight", -1.0),
        ("gravity", (0.0, 0.0)),
    ],
)
def test_bad_parameters_name_the_field(name, value):
    with pytest.raises(gp.InvalidValueError) as caught:
        gp.GraspParameters(**{name: value})
    assert caught.value.field == name


def test_joint_compliance_has_one_number_or_one_per_joint(right):
    with pytest.raises(gp.InvalidValueError) as caught:
        gp.GraspProblem.paper(right, gp.Cylinder(), parameters=gp.GraspParameters(joint_compliance=(0.1, 0.2)))
    assert caught.value.field == "joint_compliance"


def test_a_hand_that_was_asked_for_distances_is_still_the_same_hand():
    """Coal keeps what it computed in the shapes themselves; that is none of the hand's content."""
    used, fresh = gp.load_hand("dlr_hit_ii_right"), gp.load_hand("dlr_hit_ii_right")
    for entry in used.collision_model.geometryObjects:
        entry.geometry.computeLocalAABB()
    assert used == fresh and hash(used) == hash(fresh)
    wider = gp.load_hand("dlr_hit_ii_right")
    wider.collision_model.geometryObjects[3].geometry.radius += 1e-4
    assert wider != fresh
