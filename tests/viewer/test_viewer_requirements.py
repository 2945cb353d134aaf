"""Curves per requirement while planning: of the best attempt, with the registry's units."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.grasp.grasp import FEASIBILITY_TOLERANCE, IterationRecord
from grasp_planner.terms.registry import problem_constraints

from ..stored import stored


@pytest.fixture
def curves(viewer):
    panel = viewer.plan.requirements
    panel.begin(stored("clear").problem)
    yield panel
    panel.begin(None)


def record(panel, start, iteration, value):
    return IterationRecord(
        start, "one", iteration, 1.0, 1.0, 1.0, dict.fromkeys(panel.units, value), np.zeros(1), np.eye(4)
    )


def test_every_judged_requirement_of_the_search_has_a_curve_with_its_unit(curves):
    terms = {term.name: term for term in problem_constraints(stored("clear").problem) if term.judged}
    assert {name: term.unit for name, term in terms.items()} == curves.units
    curves.add([record(curves, 0, 1, 0.002)])
    assert curves.folder.visible
    assert len(curves._plot.data) == len(curves._plot.series) == len(terms) + 1
    labels = [series["label"] for series in curves._plot.series]
    assert "surface [mm]" in labels
    assert "friction [N]" in labels
    assert "compliance [°]" in labels
    assert "| surface | 2 mm | 0.001 mm | ✘ |" in curves.table.content


def test_the_attempt_that_came_closest_is_shown(curves):
    curves.add([record(curves, 0, 1, 0.1), record(curves, 0, 2, 0.01)])
    curves.add([record(curves, 1, 1, 0.1), record(curves, 1, 2, 0.05)])
    assert [each.start for each in curves.best] == [0, 0]
    curves.add([record(curves, 1, 3, 0.0)])
    assert [each.start for each in curves.best] == [1, 1, 1]
    heights = curves._plot.data[1]
    assert (np.diff(heights) < 0.0).all()
    assert heights[0] == pytest.approx(np.log10(0.1 / FEASIBILITY_TOLERANCE))
    assert heights[-1] <= 0.0, "met"
    assert "✘" not in curves.table.content


def test_another_problem_has_its_own_requirements(curves):
    before = dict(curves.units)
    curves.add([record(curves, 0, 1, 0.1)])
    problem = replace(stored("clear").problem, clearance=gp.ClearanceOptions.off())
    curves.begin(problem)
    assert not curves.folder.visible
    assert set(curves.units) < set(before)
    curves.add([record(curves, 0, 1, 0.1)])
    assert len(curves._plot.data) == len(curves.units) + 1
