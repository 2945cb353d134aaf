"""What ``hand check`` says and draws of hands with few fingers, odd names and suspicious numbers."""

from __future__ import annotations

import shlex
import warnings

import numpy as np
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.hand import hand_group
from grasp_planner.cli.main import main
from grasp_planner.drawing import hand_check_picture
from grasp_planner.drawing.hand_check_picture import check_words, draw_hand_check, patch_faces, synergy_way
from grasp_planner.hand.check import check_hand
from grasp_planner.hand.proposal import report_lines
from grasp_planner.hand.workspace import find_workspace

from .small_hands import box, finger, link, write_hand

ROOM = 'lower="-0.1" upper="1.4"'


def fingers_of(folder, count):
    """A palm with so many fingers of round rods."""
    places = [("a", "0.03 0 0.02", 3.14159), ("b", "-0.03 0 0.02", 0.0)]
    parts = [link("palm", box(0.08, 0.08, 0.02))]
    for name, place, yaw in places[:count]:
        parts += finger(name, "palm", place, yaw)
    path = folder / "hand.urdf"
    path.write_text(f'<robot name="few">{"".join(parts)}</robot>')
    return path


def test_a_hand_of_one_finger_is_said_to_hold_nothing_without_a_warning(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check = check_hand(fingers_of(tmp_path, 1))
    lines = report_lines(check)
    assert lines[-1] == "first grasp: none, a single contact holds nothing"
    assert not any("opposes" in line for line in lines)
    assert np.isfinite([*check.palm.normal, *check.palm.closing_axis, *check.palm.grasp_centre]).all()


def test_two_contacts_get_a_command_with_soft_fingers_that_plans(tmp_path):
    last = report_lines(check_hand(fingers_of(tmp_path, 2)))[-1]
    assert last.endswith("--contact-model soft")
    words = shlex.split(last.removeprefix("first grasp: "))[1:]
    done = CliRunner().invoke(main, [*words, "--enough", "1", "--no-explain"])
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (ROOM, 'lower="-10" upper="90"', "limits -10 to 90, which may be degrees"),
        ('<mass value="0.1"/>', '<mass value="-1"/>', "no mass above 0"),
    ],
)
def test_suspicious_numbers_are_said(tmp_path, old, new, said):
    path = fingers_of(tmp_path, 2)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert any(said in line for line in report_lines(check_hand(path)))


def test_names_with_control_characters_or_of_any_length_stay_on_their_line(tmp_path):
    path = fingers_of(tmp_path, 2)
    path.write_text(path.read_text().replace('"a_2"', '"a&#10;2"').replace("b_outer", "b" * 5000))
    for line in report_lines(check_hand(path)):
        assert line.isprintable() and len(line) <= 1000


@pytest.fixture(scope="module")
def check(tmp_path_factory):
    return check_hand(write_hand(tmp_path_factory.mktemp("hand"), "mesh_links"))


def test_the_picture_has_fingers_errors_of_patches_and_the_first_command(check):
    figure = draw_hand_check(check)
    assert len(figure.axes) == 5
    drawn = [text.get_text() for axes in figure.axes for text in axes.texts]
    titles = " ".join(axes.get_title() for axes in figure.axes)
    assert all(any(each.name in text for text in drawn) for each in check.fingers)
    assert "closing axis" in titles and "σ1" in titles and "where others" in titles
    words = "".join("".join(check_words(check)).split())
    command = report_lines(check)[-1].removeprefix("first grasp: ")
    assert "mmoffit" in words and words.endswith(command.replace(" ", ""))


def test_drawn_patches_are_the_balls_of_the_contacts(check):
    hand = hand_check_picture.checked_hand(check).hand
    for frame in hand.contact_frames("sphere"):
        faces = patch_faces(frame)
        np.testing.assert_allclose(np.linalg.norm(faces, axis=-1), frame.radius)
        walls, room = frame.patch.walls()
        assert (faces.reshape(-1, 3) / frame.radius @ walls.T + room >= -1e-9).all()


def test_the_first_synergy_is_drawn_from_open_to_closed():
    hand = gp.load_hand("tendon_hand")
    way = synergy_way(hand, 0)
    assert (way >= hand.lower).all() and (way <= hand.upper).all()
    assert np.linalg.norm(way[-1] - way[0]) > 1.0


def test_fingers_that_meet_share_places_and_fingers_apart_do_not(rng):
    hand = gp.load_hand("tendon_hand")
    found = find_workspace(hand, "sphere", 1, rng)
    assert 0.0 < found.overlap < 1.0 and found.volume > 1e-6
    assert found.shared.shape == (len(found.thumb),) and len(found.others) == 2 * len(found.thumb)
    alone = find_workspace(hand, "sphere", 3, rng)
    assert alone.overlap == 0.0


def test_a_stand_is_not_drawn(tmp_path, monkeypatch):
    path = fingers_of(tmp_path, 2)
    stand = '<collision><origin xyz="0 0 -0.6"/><geometry><box size="1 1 1"/></geometry></collision></link>'
    path.write_text(path.read_text().replace("</link>", stand, 1))
    drawn = []
    monkeypatch.setattr(hand_check_picture, "add_mesh", lambda axes, mesh, *rest: drawn.append(mesh.extents.max()))
    draw_hand_check(check_hand(path))
    assert drawn and max(drawn) < 0.2


def test_the_command_writes_the_picture(tmp_path):
    png = tmp_path / "hand.png"
    done = CliRunner().invoke(hand_group, ["check", str(fingers_of(tmp_path, 2)), "--png", str(png)])
    assert done.exit_code == 0 and png.read_bytes().startswith(b"\x89PNG")
