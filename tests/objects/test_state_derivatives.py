"""Every quantity the planner sees, differentiated by every variable, for every object × hand × contact set."""

from __future__ import annotations

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.planning.program import GraspProgram

from .helpers import central_differences

SHAPES = {
    "sphere": "sphere:radius=0.035",
    "cylinder": "cylinder:radius=0.03",
    "capped": "cylinder:radius=0.03,height=0.08,caps=1,edge=0.01",
    "box": "box:x=0.05,y=0.06,z=0.08,edge=0.015",
    "capsule": "capsule:radius=0.025,height=0.07",
    "ellipsoid": "ellipsoid:x=0.025,y=0.035,z=0.05",
}
MESHES = ("torus", "mug", "bracket")
SETS = {
    "dlr_hit_ii_right": (("point", 5), ("sphere", 15), ("power", 5)),
    "dlr_hit_ii_left": (("sphere", 3),),
    "allegro_right": (("sphere", 8), ("point", 16)),
    "tendon_hand": (("sphere", 4),),
}
CASES = [(hand, name, n_s) for hand, sets in SETS.items() for name, n_s in sets]
DERIVATIVES = {
    "d_gaps": lambda state: state.geometry.gaps,
    "d_forces": lambda state: state.forces.ravel(),
    "d_balance": lambda state: state.balance,
    "d_friction_margins": lambda state: state.friction_margins,
    "d_compliance": lambda state: state.compliance,
    "d_force_norm": lambda state: np.array([state.force_norm]),
    "d_task_index": lambda state: np.array([state.task_index]),
}


@pytest.fixture(scope="module")
def hands():
    return {name: gp.load_hand(name) for name in SETS}


@pytest.mark.parametrize("shape", [*SHAPES, *MESHES])
@pytest.mark.parametrize(("hand", "contact_set", "n_synergies"), CASES)
@pytest.mark.parametrize("force_law", ["springs", "controllable"])
def test_state_derivatives(hands, mesh_texts, shape, hand, contact_set, n_synergies, force_law):
    """All derivatives agree with central differences to 1e-6 of their largest entry, in the solver's units."""
    problem = gp.GraspProblem.paper(
        hand=hands[hand],
        grasp_object=gp.parse_object(SHAPES[shape] if shape in SHAPES else mesh_texts[shape]),
        tasks=(gp.force_task((0.2, 1.0, 0.3)), gp.torque_task((0.0, 0.4, 1.0))),
        n_synergies=n_synergies,
        contact_set=contact_set,
        parameters=gp.GraspParameters(force_law=force_law),
    )
    rng = np.random.default_rng(4)
    start = gp.random_start(problem, rng)
    q = problem.hand.lower + rng.uniform(0.2, 0.8, problem.hand.n_joints) * (problem.hand.upper - problem.hand.lower)
    program = GraspProgram(problem, start.palm_pose)
    z, layout = program.pack(q, start.palm_pose, start.delta_sigma), program.evaluator.layout
    z[layout.pose] += rng.normal(0.0, 0.05, 6)
    z[layout.n_geometric :] += rng.normal(0.0, 1.0, layout.size - layout.n_geometric)
    state = program.evaluator.evaluate(z * program.scale)
    for name, value in DERIVATIVES.items():
        analytic = np.atleast_2d(getattr(state, name)) * program.scale
        if analytic.size == 0:
            continue
        # Two step lengths: round-off and truncation differ, a wrong derivative is wrong with both.
        errors = []
        for step in (3e-6, 3e-7):
            numeric = central_differences(lambda v, f=value: f(program.evaluator.evaluate(v * program.scale)), z, step)
            errors.append(np.abs(analytic - numeric).max() / np.abs(numeric).max())
        assert min(errors) < 1e-6, name
