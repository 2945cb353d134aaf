"""The story of a closing hand and pushes on a held object, as the page tells them."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from grasp_planner.drawing import look
from grasp_planner.judge.margins import SLIPPED
from grasp_planner.viewer.app import PANEL_WIDTH
from grasp_planner.viewer.closing_story import HELD, ClosingStory
from grasp_planner.viewer.push import LOST, push_arrow, push_from, pushed
from grasp_planner.viewer.scene.draw_push import finger_colours
from grasp_planner.viewer.scene.draw_springs import WIDTH, resting_springs, zigzag


def settle(viewer):
    assert viewer.worker.drain(60.0)


@pytest.fixture(scope="module")
def story(grasp):
    return ClosingStory(grasp)


def test_the_hand_begins_open_and_ends_in_the_plan(story, grasp):
    first, last = story.at(0.0), story.at(HELD)
    assert not first.touching.any()
    assert not len(first.springs)
    np.testing.assert_allclose(first.joint_angles, grasp.closing.pregrasp)
    assert last.touching.any()
    moved = np.abs(last.joint_angles - grasp.joint_angles).max()
    assert moved < 1e-9 or not last.touching.all()
    np.testing.assert_allclose(last.reference, grasp.reference_joint_angles, atol=1e-9)
    np.testing.assert_allclose(last.forces, np.linalg.norm(grasp.forces, axis=1)[last.touching], rtol=1e-6)


def test_fingers_touch_one_after_the_other_and_springs_press_ever_more(story):
    moments = [story.at(time) for time in np.linspace(0.0, HELD, 41)]
    counts = [int(moment.touching.sum()) for moment in moments]
    assert counts == sorted(counts)
    assert len(set(counts)) > 2, "not all at once"
    assert (np.diff([moment.forces.sum() for moment in moments]) >= 0.0).all()
    for moment in moments:
        assert len(moment.springs) == len(moment.forces) == moment.touching.sum()


def test_a_push_grows_until_the_finger_that_the_margin_names_slips(grasp):
    margin = grasp.passive_margin
    way = margin.direction[:3]
    assert (pushed(grasp, 0.98 * margin.size * way).use < 1.0).all()
    beyond = pushed(grasp, (1.02 * margin.size + SLIPPED) * way)
    lost = [frame.name for frame, use in zip(grasp.problem.frames, beyond.use, strict=True) if use >= 1.0]
    assert lost
    assert any(name in margin.gives_way for name in lost)
    assert (beyond.colours[beyond.use >= 1.0] == LOST).all()
    assert "slips" in beyond.text([frame.name for frame in grasp.problem.frames])


def test_pushed_forces_balance_load_and_push(grasp):
    push = np.array([0.2, -0.3, 0.1])
    answer = pushed(grasp, push)
    np.testing.assert_allclose(answer.forces.sum(axis=0), -grasp.problem.external_wrench[:3] - push, atol=1e-6)
    np.testing.assert_allclose(pushed(grasp, np.zeros(3)).forces, grasp.forces)


def test_the_arrow_of_a_push_can_be_dragged_by_its_begin():
    push = np.array([0.5, -1.0, 2.0])
    begin, end = push_arrow(push)
    np.testing.assert_allclose(push_from(begin), push)
    assert (end - begin) @ push > 0.0, "it points along the push"
    assert not push_from(np.array([0.0, 0.01, 0.0])).any()


def test_a_spring_goes_from_one_end_to_the_other():
    begin, end = np.array([0.0, 0.0, 0.01]), np.array([0.02, 0.0, 0.01])
    segments = zigzag(begin, end)
    np.testing.assert_allclose(segments[0, 0], begin)
    np.testing.assert_allclose(segments[-1, 1], end)
    np.testing.assert_allclose(segments[1:, 0], segments[:-1, 1])
    assert np.abs(segments[..., 1]).max() == pytest.approx(WIDTH)


def test_the_slider_tells_the_story_and_the_grasp_comes_back(viewer, grasp):
    viewer.synergies.story.value = 1.5
    settle(viewer)
    preview = viewer.session.preview
    assert preview is not None
    assert preview.story is not None
    assert "touch" in viewer.card.widget.content
    assert viewer.picture._springs._lines.visible
    assert viewer.picture._ghosts["reference"].visible
    viewer.synergies.story.value = HELD
    settle(viewer)
    assert viewer.session.preview is None
    assert viewer.session.grasp is grasp
    assert not viewer.picture._springs._lines.visible
    assert not viewer.picture._ghosts["reference"].visible


def test_playing_the_closing_ends_in_the_grasp(viewer, grasp):
    viewer.grasp_panel.play.value = True
    settle(viewer)
    assert viewer.session.preview is None
    assert viewer.session.grasp is grasp


def test_slices_are_drawn_on_request_and_go_with_their_grasp(viewer, grasp):
    panel = viewer.why
    settle(viewer)
    assert not panel.drawn.visible and not panel.slices.disabled
    panel.slices.value = True
    settle(viewer)
    assert panel.drawn.visible
    height, width, _ = np.asarray(panel.drawn.image).shape
    assert width > 2 * PANEL_WIDTH and height > width, "three rows, sharp on good screens"
    viewer.worker.submit(lambda: viewer.session.show(moved(grasp), "test"))
    settle(viewer)
    assert not panel.drawn.visible, "they are those of another grasp"


def moved(grasp):
    """Return a grasp whose palm is a little off."""
    return replace(grasp, palm_pose=grasp.palm_pose * pin.SE3(np.eye(3), np.array([0.0, 0.0, 1e-3])))


def test_a_push_is_tried_from_the_weakest_side_and_dragged(viewer, grasp):
    panel = viewer.why
    panel.size.value = 0.5
    panel.push.value = True
    settle(viewer)
    np.testing.assert_allclose(viewer.session.push, 0.5 * grasp.passive_margin.direction[:3])
    assert "of its friction" in panel.answer.content
    assert viewer.picture._push.handle.visible
    assert viewer.picture._push._held.scale == pytest.approx(np.linalg.norm(push_begin(grasp.passive_margin.size)))
    colours = {tuple(mesh.color) for mesh in viewer.picture._hand.meshes.values()}
    assert look.HAND not in colours, "every finger has the colour of its share"
    viewer.picture.push_dragged(np.array([0.0, 0.0, -0.1]))
    settle(viewer)
    np.testing.assert_allclose(viewer.session.push / panel.size.value, [0.0, 0.0, 1.0], atol=1e-6)
    panel.push.value = False
    settle(viewer)
    assert viewer.session.push is None
    assert not viewer.picture._push.handle.visible
    assert look.HAND in {tuple(mesh.color) for mesh in viewer.picture._hand.meshes.values()}


def push_begin(size):
    """Return where the arrow of a push of some size begins; the pale sphere ends there for the largest one held."""
    return push_arrow(np.array([size, 0.0, 0.0]))[0]


def test_a_finger_has_the_colour_of_its_contact_and_shared_links_the_worst(grasp):
    margin = grasp.passive_margin
    answer = pushed(grasp, (1.02 * margin.size + SLIPPED) * margin.direction[:3])
    colours = finger_colours(grasp, answer)
    for frame, colour in zip(grasp.problem.frames, answer.colours, strict=True):
        assert colours[frame.link] == tuple(colour)
    assert grasp.problem.hand.description.palm.link not in colours
    assert LOST in colours.values()


def test_at_rest_springs_go_from_fingertips_to_where_the_motors_would_have_them(grasp, viewer):
    springs, forces = resting_springs(grasp)
    radii = np.linalg.norm(springs[:, 0] - grasp.contacts.points, axis=1)
    np.testing.assert_allclose(radii, grasp.problem.radii, atol=1e-6)
    gaps = np.linalg.norm(springs[:, 1] - springs[:, 0], axis=1)
    assert (gaps > 1e-4).all(), "every finger presses"
    np.testing.assert_allclose(forces, np.linalg.norm(grasp.forces, axis=1))
    viewer.synergies.springs.value = True
    settle(viewer)
    assert viewer.picture._springs._lines.visible
    assert viewer.picture._ghosts["reference"].visible
    viewer.synergies.springs.value = False
    settle(viewer)
    assert not viewer.picture._springs._lines.visible
    assert not viewer.picture._ghosts["reference"].visible
