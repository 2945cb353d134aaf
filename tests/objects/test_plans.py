"""Plans on every kind of object, with few and with all synergies."""

from __future__ import annotations

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.objects.triangles import Triangles
from grasp_planner.records.grasp_record import grasp_record

from .test_state_derivatives import MESHES, SHAPES

QUICK = gp.PlannerOptions(starts=25, enough=1)
# These tests are about contacts and forces alone: where links have to keep clear too, that is left out.


@pytest.mark.slow
@pytest.mark.parametrize("n_synergies", [15, 5])
@pytest.mark.parametrize("shape", [*SHAPES, *MESHES])
def test_dlr_plans(mesh_texts, shape, n_synergies):
    """Five spherical fingertips of the DLR/HIT II hold every shape."""
    problem = gp.GraspProblem.paper(
        hand=gp.load_hand("dlr_hit_ii_right"),
        grasp_object=gp.parse_object(SHAPES.get(shape) or mesh_texts[shape]),
        n_synergies=n_synergies,
        contact_set="sphere",
    )
    grasp = gp.plan_grasp(problem, seed=1, options=QUICK)
    assert grasp.feasible, grasp.verdict


@pytest.mark.parametrize("name", MESHES)
def test_contacts_touch_the_real_mesh(mesh_texts, name):
    """Fingertips planned on the smooth distance touch the exact mesh to 0.3 mm; the record brings the mesh back."""
    problem = gp.GraspProblem.paper(
        hand=gp.load_hand("allegro_right"), grasp_object=gp.parse_object(mesh_texts[name]), n_synergies=16
    )
    grasp = gp.plan_grasp(problem, seed=1, options=QUICK)
    assert grasp.feasible, grasp.verdict
    centres = grasp.contacts.points - problem.radii[:, None] * grasp.contacts.normals
    exact = Triangles.of(problem.grasp_object.mesh).signed_distance(centres)
    np.testing.assert_allclose(exact, problem.radii, atol=3e-4)
    again = gp.grasp_from_record(grasp_record(grasp), problem.hand)
    assert again.feasible
