"""The front of force against the angle of the task."""

from dataclasses import dataclass

import pytest
from click.testing import CliRunner

from grasp_planner.cli.main import main
from grasp_planner.planning.trade import task_angle, trade_front, trade_text, traded_grasps
from tests.stored import stored


@dataclass(frozen=True)
class Point:
    """A grasp of which only force and angle count."""

    force_norm: float
    angle: float
    feasible: bool = True

    @property
    def alignments(self):
        """The angle of the only task."""
        return [(self.angle, False)]


KNOWN = [Point(3.0, 67.0), Point(17.0, 34.0), Point(18.0, 40.0), Point(3.5, 70.0), Point(1.0, 5.0, False)]


def test_the_front_has_nothing_that_is_worse_in_both():
    assert trade_front(KNOWN) == (Point(3.0, 67.0), Point(17.0, 34.0))
    assert task_angle(Point(2.0, float("nan"))) == 180.0, "no ellipsoid serves nothing"


def test_the_trade_is_told_where_more_force_serves_the_task_better():
    front = trade_front(KNOWN)
    assert trade_text(front, KNOWN[0]) == "34° at 17 N, 67° at 3 N"
    assert trade_text(front, KNOWN[1]) is None, "nothing serves it better"
    assert trade_text(trade_front([Point(3.0, 12.0), Point(9.0, 0.0)]), Point(3.0, 12.0)) is None, "it is served"
    assert trade_text((), KNOWN[0]) is None


@pytest.mark.slow
def test_with_more_force_near_a_grasp_the_task_is_served_no_worse():
    grasp = stored("clear")
    found = traded_grasps(grasp)
    assert found
    assert all(each.feasible for each in found)
    more = [each.task_index for each in found if each.force_norm > grasp.force_norm]
    assert more == sorted(more, reverse=True)
    for each in found:
        assert each.force_norm <= 8.0 * grasp.force_norm * (1.0 + 1e-6)


def test_plan_draws_the_front(tmp_path, monkeypatch):
    grasp, picture = stored("clear"), tmp_path / "front.png"
    monkeypatch.setattr("grasp_planner.cli.plan.plan_grasps", lambda *given, **named: (grasp,))
    result = CliRunner().invoke(main, ["plan", "--trade", str(picture)])
    assert result.exit_code == 0, result.output
    assert "front of force and task" in result.output
    assert picture.read_bytes().startswith(b"\x89PNG")
