"""What a grasp can do and cannot: subspaces of its matrices, by orthonormal bases, and the names they give it.

[Prattichizzo2016] chapter 38: the null spaces of G, Gᵀ, J and Jᵀ make a grasp graspable, indeterminate, redundant or
defective; with springs the internal forces split into those the motors command and the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ..spatial import Array
from ..values import Value
from .quasi_static import RANK, CompliantGrasp, quasi_static_maps, resisted_motions

UNMOVED = 1e-100
"""A matrix without larger entries counts as zero."""
NO_ARM = 1e-11
"""Lever arms below this, in the unit of length, are none: all forces act through the centre."""
BLOCKS = (
    "wrench",
    "contact_forces",
    "joint_torques",
    "motor_forces",
    "object_motion",
    "joint_motion",
    "synergy_motion",
    "references",
)
"""The blocks of a change, in the order in which they are stacked."""


@dataclass(frozen=True, eq=False, repr=False)
class GraspSubspaces(Value):
    """Null spaces of the matrices of a grasp, each with orthonormal columns; none where it is empty.

    Attributes:
        internal_forces: Null(G): forces that balance themselves, of shape (n, k).
        free_motions: Null(Gᵀ): twists of the object no contact resists, of shape (6, k).
        redundant_motions: Null(J): joint motions that move no contact, of shape (n_q, k).
        structural_forces: Null(Jᵀ): contact forces that load no joint, of shape (n, k).
        hyperstatic_forces: Null(G) ∩ Null(Jᵀ): internal forces that no joint feels, of shape (n, k).
    """

    internal_forces: Array
    free_motions: Array
    redundant_motions: Array
    structural_forces: Array
    hyperstatic_forces: Array

    @property
    def classes(self) -> tuple[str, ...]:
        """The names of [Prattichizzo2016] table 38.5 that hold."""
        named = {
            "indeterminate": self.free_motions,
            "graspable": self.internal_forces,
            "redundant": self.redundant_motions,
            "defective": self.structural_forces,
            "hyperstatic": self.hyperstatic_forces,
        }
        return tuple(name for name, basis in named.items() if basis.shape[1])


@dataclass(frozen=True, eq=False, repr=False)
class HomogeneousSolution(Value):
    """All changes of a compliant grasp, split into three kinds; every block has one column a change.

    Each kind holds the blocks of :data:`BLOCKS` by name. The reference is z_r = z + C_z σ, so that σ = K_z (z_r − z).

    Attributes:
        rigid: Motions in which no spring bends, G f = 0 and f = 0.
        internal: Changes of internal forces at w = 0.
        external: Answers to a wrench on the object, references held, one column for each wrench contacts can exert.
    """

    rigid: dict[str, Array]
    internal: dict[str, Array]
    external: dict[str, Array]

    @property
    def least_internal(self) -> dict[str, Array]:
        """The internal changes less their rigid part: of least norm over all blocks, in the units that they have."""
        return _unstacked(self.internal, _apart(stacked_change(self.internal), stacked_change(self.rigid)))

    @property
    def least_external(self) -> dict[str, Array]:
        """The external changes less their internal and rigid part, motors moving as that takes; of least norm.

        The norm adds newtons, radians and metres, so it depends on the units; this is the split that SynGrasp makes.
        """
        others = np.hstack([stacked_change(self.internal), stacked_change(self.rigid)])
        return _unstacked(self.external, _apart(stacked_change(self.external), others))


def stacked_change(change: dict[str, Array]) -> Array:
    """Return the blocks of a change one below the other, in the order of :data:`BLOCKS`."""
    return np.vstack([change[name] for name in BLOCKS])


def projector(basis: Array) -> Array:
    """Return the orthogonal projector onto the columns of any matrix, of shape (n, n)."""
    orthonormal = range_basis(basis)
    return orthonormal @ orthonormal.T


def range_basis(matrix: Array, rank: float = RANK) -> Array:
    """Return an orthonormal basis of the range of a matrix, of shape (n, rank)."""
    if not matrix.size:
        return np.zeros((matrix.shape[0], 0))
    left, values, _ = np.linalg.svd(matrix, full_matrices=False)
    return np.asarray(left[:, values > rank * max(float(values[0]), 1e-300)])


def null_basis(matrix: Array, rank: float = RANK) -> Array:
    """Return an orthonormal basis of the null space of a matrix, of shape (columns, nullity)."""
    return np.asarray(linalg.null_space(matrix, rcond=rank))


def grasp_subspaces(grasp: Array, jacobian: Array) -> GraspSubspaces:
    """Return the null spaces of a grasp.

    Args:
        grasp: G, of shape (6, n).
        jacobian: J, of shape (n, n_q); J S for a hand whose joints follow its motors.

    Returns:
        Bases of all of them.
    """
    # Lengths are small: moments over the contacts' spread, so that rank does not depend on the unit.
    scaled = _scaled(grasp)
    both = np.vstack([scaled, jacobian.T / max(float(np.abs(jacobian).max(initial=0.0)), 1e-300)])
    return GraspSubspaces(
        internal_forces=null_basis(scaled),
        free_motions=null_basis(grasp.T),
        redundant_motions=null_basis(jacobian),
        structural_forces=null_basis(jacobian.T),
        hyperstatic_forces=null_basis(both),
    )


def commanded_forces(springs: CompliantGrasp) -> Array:
    """Return an orthonormal basis E of the internal forces that the motors command, the range of P.

    [Gabiccini2011]; of shape (n, ≤ n_z).
    """
    return range_basis(quasi_static_maps(springs, free="none").commands.contact_forces)


def rigid_body_motions(springs: CompliantGrasp) -> dict[str, Array]:
    """Return the motions of hand and object in which no spring bends: J S z = Gᵀ u; [Prattichizzo2013].

    Returns:
        ``synergy_motion`` z, of shape (n_z, k), ``joint_motion`` q = S z and ``object_motion`` u, of shape (6, k).
    """
    n_z = springs.basis.shape[1]
    moved, held = springs.jacobian @ springs.basis, springs.grasp.T
    # One scale a block keeps the null space and makes the rank independent of units.
    largest = [float(np.abs(block).max(initial=0.0)) for block in (moved, held)]
    sizes = [size if size > UNMOVED else 1.0 for size in largest]
    both = null_basis(np.hstack([moved / sizes[0], -held / sizes[1]]))
    z, u = both[:n_z] / sizes[0], both[n_z:] / sizes[1]
    return {"synergy_motion": z, "joint_motion": springs.basis @ z, "object_motion": u}


def homogeneous_solution(springs: CompliantGrasp) -> HomogeneousSolution:
    """Return every change that the springs and the balance of the object allow, in three kinds.

    Args:
        springs: The grasp.

    Returns:
        Rigid motions, internal changes along an orthonormal basis of the commanded forces, answers to a wrench.
    """
    maps = quasi_static_maps(springs, free="none")
    rigid = rigid_body_motions(springs)
    z = rigid["synergy_motion"]
    n, n_q = springs.jacobian.shape
    columns = z.shape[1]
    rigid |= {
        "contact_forces": np.zeros((n, columns)),
        "joint_torques": np.zeros((n_q, columns)),
        "motor_forces": np.zeros((springs.basis.shape[1], columns)),
        "wrench": np.zeros((6, columns)),
        "references": z,
    }
    forces = maps.commands.contact_forces
    references = np.linalg.pinv(forces, rcond=RANK) @ range_basis(forces)
    internal = _named(maps.commands.of(references).__dict__)
    internal |= {"wrench": np.zeros((6, references.shape[1])), "references": references}
    wrenches = resisted_motions(springs.grasp)
    external = _named(maps.wrench.of(wrenches).__dict__)
    external |= {"wrench": wrenches, "references": np.zeros((springs.basis.shape[1], wrenches.shape[1]))}
    return HomogeneousSolution(rigid, internal, external)


def _named(fields: dict[str, Array]) -> dict[str, Array]:
    """Return the maps of an answer by name."""
    return {name: value for name, value in fields.items() if not name.startswith("_")}


def _apart(changes: Array, others: Array) -> Array:
    """Return changes less their part in the range of others."""
    # Columns of one size: kinds of changes differ by orders of magnitude in their units.
    basis = range_basis(others / np.maximum(np.linalg.norm(others, axis=0), 1e-300))
    return changes - basis @ (basis.T @ changes)


def _unstacked(like: dict[str, Array], rows: Array) -> dict[str, Array]:
    """Return stacked rows as blocks of the sizes of another change."""
    cuts = np.cumsum([len(like[name]) for name in BLOCKS])[:-1]
    return dict(zip(BLOCKS, np.split(rows, cuts), strict=True))


def _scaled(grasp: Array) -> Array:
    """Return G with its forces and its moments scaled to size one; moments that are only rounding stay small."""
    forces, moments = (float(np.abs(rows).max(initial=0.0)) for rows in (grasp[:3], grasp[3:]))
    arms = moments if moments > NO_ARM * forces else forces
    return np.asarray(grasp / np.maximum(np.repeat([forces, arms], 3), 1e-300)[:, None])
