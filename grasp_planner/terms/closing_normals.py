"""Fingers press along the surface normals as they close."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..model.compliance import bent
from ..problem.problem import GraspProblem
from ..spatial import Array
from .small_cost import SmallCost

STILL = 1e-5
"""Motion of a contact that smooths its direction where it does not move [m]."""


class ClosingNormals(SmallCost):
    """Mean of 1 − cos of the angle between a contact's normal and where its finger goes as it closes the last bit.

    Without the object the fingers would go on to the reference posture q_r: contacts move by J (q_r − q). For other
    contacts than hard fingers the motion and ν are those of the intensities.
    """

    name, setting = "closing_normals", "closing_weight"

    def weight(self, problem: GraspProblem) -> float:
        """Return its weight in a problem, where least force comes first also if none is given."""
        return problem.parameters.closing_preference

    def measure(self, problem: GraspProblem, state: GraspState) -> tuple[float, Array]:
        """Return the measure and its gradient."""
        geometry, joints = state.geometry, slice(0, problem.hand.n_joints)
        nu, n_g = geometry.covectors, geometry.d_jacobian.shape[0]
        squeeze, d_squeeze = state.reference - state.x[joints], np.array(state.d_reference)
        d_squeeze[:, joints] -= np.eye(len(squeeze))
        moved = (geometry.jacobian @ squeeze).reshape(nu.shape)
        d_moved = geometry.jacobian @ d_squeeze
        d_moved[:, :n_g] += (geometry.d_jacobian @ squeeze).T
        d_moved = d_moved.reshape(*nu.shape, -1)
        size = np.sqrt((moved**2).sum(axis=1) + STILL**2)
        along = (nu * moved).sum(axis=1)
        d_along = np.einsum("ij,ijk->ik", nu, d_moved)
        d_along[:, :n_g] += np.einsum("ij,ijk->ik", moved, geometry.d_covectors)
        d_size = np.einsum("ij,ijk->ik", moved, d_moved) / size[:, None]
        cosine = along / size
        return float(1.0 - cosine.mean()), -((d_along - cosine[:, None] * d_size) / size[:, None]).mean(axis=0)

    def clear_measure(self, grasp: PosedGrasp) -> float:
        """Return the measure."""
        squeeze = bent(grasp.problem.joint_compliance, grasp.bending_torques)
        moved = (grasp.hand_jacobian @ squeeze).reshape(grasp.covectors.shape)
        along = np.einsum("ij,ij->i", moved, grasp.covectors)
        return float(np.mean(1.0 - along / np.sqrt((moved**2).sum(axis=1) + STILL**2)))
