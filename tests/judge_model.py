"""The model of a DLR/HIT II grasp of an upright cylinder or a ball, written once more for the tests of the judge.

Only Pinocchio's forward kinematics and joint Jacobians and numpy; nothing of the package but the numbers of the
problem (a hand's model, C_q, S, q̄, options).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import pinocchio as pin

import grasp_planner as gp

FINGERS = ("thumb", "index", "middle", "ring", "little")


def cross(a):
    """Return the matrix of the cross product with a."""
    return np.array([np.cross(a, e) for e in np.eye(3)]).T


def full_angles(hand, q):
    """Return the angles of all joints of the URDF: every DIP joint turns with its PIP joint."""
    angles = dict(zip(hand.joint_names, q, strict=True))
    return np.array([angles[name.replace("dip", "pip")] for name in hand.model.names.tolist()[1:]])


def placed(grasp):
    """Return Pinocchio's data at the posture and the pose of the model's root in O; the palm is a link."""
    model = grasp.problem.hand.model
    data = model.createData()
    pin.computeJointJacobians(model, data, full_angles(grasp.problem.hand, grasp.joint_angles))
    pin.updateFramePlacements(model, data)
    return data, grasp.palm_pose * data.oMf[model.getFrameId("palm")].inverse()


@dataclass
class ByHand:
    """Contacts, forces and torques of a grasp."""

    points: np.ndarray
    normals: np.ndarray
    gaps: np.ndarray
    grasp_matrix: np.ndarray
    jacobian: np.ndarray
    forces: np.ndarray
    torques: np.ndarray
    internal_torques: np.ndarray
    stiffness: np.ndarray

    @property
    def normal_forces(self):
        """f_n."""
        return np.array([f @ n for f, n in zip(self.forces, self.normals, strict=True)])

    def slack(self, friction, forces=None):
        """Return μ f_n − |f_t| of each contact."""
        forces = self.forces if forces is None else forces
        found = []
        for f, n in zip(forces, self.normals, strict=True):
            found.append(friction * (f @ n) - np.linalg.norm(np.cross(n, f)))
        return np.array(found)


def by_hand(grasp, *, weight=None):
    """Evaluate a grasp.

    Args:
        grasp: The grasp.
        weight: Force of gravity in O [N]; mass times 9.81 along −z if None.
    """
    problem, parameters = grasp.problem, grasp.problem.parameters
    shape, model = problem.grasp_object, problem.hand.model
    kind = "pad" if problem.contact_set == "sphere" else "tip"
    radius = 0.01 if kind == "pad" else 0.0
    data, root = placed(grasp)
    names = [name for name in FINGERS if problem.contacts is None or name in problem.contacts]
    points, normals, gaps, rows = [], [], [], []
    for name in names:
        centre = root.act(data.oMf[model.getFrameId(f"{name}_{kind}")].translation)
        axis = np.array(centre) * ([1.0, 1.0, 0.0] if isinstance(shape, gp.Cylinder) else 1.0)
        out = axis / np.linalg.norm(axis)
        normals.append(-out)
        points.append(centre - radius * out)
        gaps.append(np.linalg.norm(axis) - shape.radius - radius)
        joint = model.getJointId(f"{name}_dip")
        local = pin.getJointJacobian(model, data, joint, pin.LOCAL_WORLD_ALIGNED)
        arm = points[-1] - root.act(data.oMi[joint].translation)
        every = root.rotation @ local[:3] - cross(arm) @ root.rotation @ local[3:]
        columns = dict(zip(model.names.tolist()[1:], every.T, strict=True))
        single = [
            columns[n] + columns.get(n.replace("pip", "dip") if "pip" in n else "", 0.0)
            for n in problem.hand.joint_names
        ]
        rows.append(np.array(single).T)
    jacobian = np.vstack(rows)
    g = np.vstack([np.hstack([np.eye(3)] * len(names)), np.hstack([cross(point) for point in points])])
    m = len(jacobian)
    c_q = np.diag(problem.joint_compliance)
    k_m = np.linalg.inv(parameters.structural_compliance * np.eye(m) + jacobian @ c_q @ jacobian.T)
    k = np.linalg.inv(np.eye(m) / parameters.contact_stiffness + jacobian @ c_q @ jacobian.T)
    right = k_m @ g.T @ np.linalg.inv(g @ k_m @ g.T)
    if weight is None:
        weight = np.array([0.0, 0.0, -9.81 * shape.mass])
    load = np.concatenate([weight, np.zeros(3)])
    squeezed = (k_m + parameters.contact_stiffness * np.eye(m)) @ jacobian @ problem.synergies.basis @ grasp.delta_sigma
    internal = squeezed - right @ (g @ squeezed)
    forces = internal - right @ load
    return ByHand(
        np.array(points),
        np.array(normals),
        np.array(gaps),
        g,
        jacobian,
        forces.reshape(-1, 3),
        jacobian.T @ forces,
        jacobian.T @ internal,
        k,
    )


def answers(model, disturbance, displacement=None):
    """Return the contact forces after a disturbance Δw and, where given, a small motion ν of the object."""
    g, k = model.grasp_matrix, model.stiffness
    change = k @ g.T @ np.linalg.solve(g @ k @ g.T, disturbance)
    if displacement is not None:
        change = change + k @ g.T @ displacement
    return model.forces - change.reshape(-1, 3)


def cube_directions():
    """Return the 6 axes and the 8 diagonals of a cube."""
    axes = [sign * e for sign in (1.0, -1.0) for e in np.eye(3)]
    return np.array([*axes, *(np.array(p) / np.sqrt(3.0) for p in product((-1.0, 1.0), repeat=3))])


def load_forces(model, loads, mass):
    """Return the contact forces of all load cases; those of spheres at the 14 directions of a cube."""
    none = np.zeros(6)
    found = [model.forces, *(answers(model, np.array(wrench)) for wrench in loads.wrenches)]
    for d in cube_directions():
        force = np.concatenate([max(loads.force, mass * loads.acceleration) * d, np.zeros(3)])
        torque = np.concatenate([np.zeros(3), loads.torque * d])
        shift = np.concatenate([loads.position_error * d, np.zeros(3)])
        turn = np.concatenate([np.zeros(3), loads.rotation_error * d])
        found += [
            answers(model, force),
            answers(model, torque),
            answers(model, none, shift),
            answers(model, none, turn),
        ]
    return np.array(found)


def load_extremes(model, loads, mass, values):
    """Return the least and largest linear function of the forces over all load cases, spheres exactly.

    Args:
        model: The grasp.
        loads: The load cases.
        mass: Mass of the object [kg].
        values: Maps forces, of shape (n_c, 3), to numbers; linear.
    """
    nominal, none = values(model.forces), np.zeros(6)
    every = [nominal, *(values(answers(model, np.array(wrench))) for wrench in loads.wrenches)]
    radii = (max(loads.force, mass * loads.acceleration), loads.torque, loads.position_error, loads.rotation_error)
    for kind, radius in enumerate(radii):
        squared = np.zeros_like(nominal)
        for k in range(3):
            unit = np.zeros(12)
            unit[3 * kind + k] = radius
            moved = answers(model, unit[:6], unit[6:]) if kind > 1 else answers(model, unit[:6], none)
            squared += (values(moved) - nominal) ** 2
        every += [nominal - np.sqrt(squared), nominal + np.sqrt(squared)]
    return np.min(every, axis=0), np.max(every, axis=0)
