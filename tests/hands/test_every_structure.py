"""Small hands with one structure each, from their URDF to a simulated grasp, as a new user tries them."""

from __future__ import annotations

import pytest

from ..scripts import load_script
from .small_hands import HANDS, write_hand

PLANNED = tuple(name for name in HANDS if name != "four_bar")
"""The flat parallel pads of that gripper touch at edges: what is found ends 1e-5 m and 5e-6 N from feasible."""
HELD = 4
"""Fewest of six pushes held in simulation: which of several grasps is found may change."""


@pytest.fixture(scope="module")
def script():
    return load_script("check_hands")


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANNED)
def test_a_hand_plans_and_reopens(tmp_path, script, name):
    """From check over plan, export and analyse to simulate; nothing is edited, the object is in size for the hand."""
    rows = []
    script.tried(write_hand(tmp_path, name), tmp_path, rows.append, "--enough", "1", once=True)
    last = rows[-1]
    assert last["check"] == last["feasible"] == last["clear"] == last["reopened"] == "yes", last
    assert int(last["pushes held"][0]) >= HELD, last


def test_a_hand_that_fails_is_one_row_with_its_reason(tmp_path, script):
    (tmp_path / "bad.urdf").write_text('<robot name="bad"><link name="only"/></robot>', encoding="utf-8")
    rows = []
    script.tried(tmp_path / "bad.urdf", tmp_path, rows.append)
    assert len(rows) == 1 and rows[0]["check"] == "no"
    assert rows[0]["what fails"] and "\n" not in rows[0]["what fails"]
