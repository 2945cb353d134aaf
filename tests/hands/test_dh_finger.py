"""Fingers by Denavit–Hartenberg parameters: SynGrasp's frames and Jacobian, and differences."""

import json

import numpy as np
import pytest

from grasp_planner import InvalidValueError
from grasp_planner.hand.dh_finger import DhFinger, dh_twists
from grasp_planner.model import complete_jacobian, contact_selection
from tests.documents import ROOT
from tests.finite_differences import central_differences

FOREIGN = json.loads((ROOT / "tests" / "data" / "foreign" / "three_fingers.json").read_text(encoding="utf-8"))
FINGERS = [DhFinger(each["base"], each["table"]) for each in FOREIGN["fingers"]]
CONTACTS = [tuple(each) for each in FOREIGN["contacts"]]


def test_frames_points_and_jacobian_are_those_of_syngrasp():
    for finger, known in zip(FINGERS, FOREIGN["fingers"], strict=True):
        np.testing.assert_allclose(finger.frames[-1], known["tip"], atol=1e-14)
    points, twists = dh_twists(FINGERS, CONTACTS)
    np.testing.assert_allclose(points, FOREIGN["points"], atol=1e-15)
    selection = contact_selection(np.array(FOREIGN["normals"]), ["hard"] * 3)
    np.testing.assert_allclose(selection @ complete_jacobian(twists), FOREIGN["J"], atol=1e-15)


@pytest.mark.parametrize(("link", "share"), [(1, 0.3), (3, 1.0)])
def test_a_point_moves_as_its_twist_says(link, share):
    finger = FINGERS[1]
    q = finger.table[:, 2]
    twist = finger.twist(link, finger.point(link, share))
    numeric = central_differences(lambda x: finger.moved(x).point(link, share), q, 1e-6)
    np.testing.assert_allclose(twist[:3], numeric, atol=1e-9)
    turned = central_differences(lambda x: finger.moved(x).frames[link + 1][:3, :3].ravel(), q, 1e-6)
    for k, axis in enumerate(twist[3:].T):
        spin = turned[:, k].reshape(3, 3) @ finger.frames[link + 1][:3, :3].T
        np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], axis, atol=1e-8)
    assert not twist[:, link + 1 :].any()


def test_wrong_fingers_are_refused():
    with pytest.raises(InvalidValueError, match="table"):
        DhFinger(np.eye(4), np.ones((2, 3)))
    with pytest.raises(InvalidValueError, match="base"):
        DhFinger(np.eye(3), np.ones((2, 4)))
    with pytest.raises(InvalidValueError, match="link"):
        FINGERS[0].point(4, 0.5)
    with pytest.raises(InvalidValueError, match="q"):
        FINGERS[0].moved([0.0])
