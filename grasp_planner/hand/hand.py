"""What a hand is: URDF kinematics, coupling of its joints, contact frames and synergies, by joint name."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import coal
import numpy as np

from ..checks import finite_array, positive_definite
from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Array, Pose, readonly
from ..synergies.space import SynergySpace, load_synergies
from ..values import LONGEST_PART, Value, clipped
from .capsule_fit import FittedCapsules
from .closing import find_closing
from .closing_synergies import CLOSING, MOTORS, closing_synergies, motor_synergies
from .contact_frame import ContactFrame, find_contact_frame
from .description import HandDescription
from .fingers import find_fingers
from .geometry_mesh import collision_content
from .hull_fit import FittedHull
from .mesh_fit import fit_mesh
from .motion import HandMotion
from .solids import HandSolids
from .source import HandSource
from .tendons import TENDONS, Tendons, described_tendons


@dataclass(frozen=True, eq=False, repr=False)
class Hand(Value):
    """A robot hand: kinematics, coupling, contact frames and synergies.

    The URDF is loaded with all its joints free; the coupling of [Mavrogiannis2014] section IV (DIP = PIP for
    the DLR/HIT II) is the linear map ``q_full = coupling @ q + coupling_offset``.

    Attributes:
        description: What its description file says.
        folder: Folder of the description file.
        model: Pinocchio model with all URDF joints, of ``model.nv`` joints.
        collision_model: Collision geometries (coal) of the links.
        coupling: From independent to all joint angles, of shape (nv, n_q).
        coupling_offset: Angles of all joints at q = 0 [rad], of shape (nv,).
        lower: Lower limits of the independent joints [rad], of shape (n_q,).
        upper: Upper limits [rad], of shape (n_q,).
        palm_in_root: Pose of the palm frame P in the root frame of the URDF.
        palm_normal: Unit normal out of the palm, in P, of shape (3,).
        closing_axis: Unit axis the fingers close around, in P, of shape (3,).
        grasp_centre: Where the middle of a grasped object sits, in P [m], of shape (3,).
        source: The files it was loaded from; None for a hand that was made otherwise.
        findings: What was repaired in its URDF and derived from it, one line each.
    """

    description: HandDescription
    folder: Path
    model: Any
    collision_model: Any
    coupling: Array
    coupling_offset: Array
    lower: Array
    upper: Array
    palm_in_root: Pose
    palm_normal: Array
    closing_axis: Array
    grasp_centre: Array
    source: HandSource | None = field(default=None, compare=False)
    findings: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "palm_in_root", Pose.of(self.palm_in_root))
        super().__post_init__()

    def _content(self) -> dict[str, Any]:
        """Return the fields, of description and models what they are written as, of files what was in them."""
        written = {
            "description": self.description.model_dump_json(),
            "model": self.model.saveToString(),
            "collision_model": collision_content(self.collision_model),
            "folder": self.folder if self.source is None else self.source.content_hash,
        }
        return super()._content() | written

    def __repr__(self) -> str:
        return f"Hand({clipped(self.name, LONGEST_PART)!r}, {self.n_joints} joints)"

    @property
    def name(self) -> str:
        """Name of the hand."""
        return self.description.name

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the independent joints, in the order of q."""
        return self.description.joints

    @property
    def n_joints(self) -> int:
        """Number of independent joints n_q."""
        return len(self.description.joints)

    @property
    def contact_set_names(self) -> tuple[str, ...]:
        """Names of the contact sets; the first is the default."""
        return tuple(self.description.contact_sets)

    @property
    def synergy_set_names(self) -> tuple[str, ...]:
        """Names of the synergy sets that come with the hand; of one without files, those that every hand has."""
        own = (TENDONS,) if self.description.tendons is not None else ()
        return tuple(dict.fromkeys((*own, *self.description.synergies.sets))) or (CLOSING, MOTORS)

    def joint_index(self, name: str) -> int:
        """Return the index of an independent joint in q.

        Raises:
            NameNotFoundError: If there is no such joint; lists those that exist.
        """
        try:
            return self.joint_names.index(name)
        except ValueError:
            raise NameNotFoundError("joint", name, self.joint_names) from None

    def posture(self, angles: dict[str, float], base: Array | None = None) -> Array:
        """Return a posture from joint angles by name.

        Args:
            angles: Angle of some joints [rad].
            base: Angles of the others [rad], of shape (n_q,); zero if left out.

        Returns:
            Posture q [rad], of shape (n_q,).

        Raises:
            NameNotFoundError: If a joint does not exist.
        """
        q = np.zeros(self.n_joints) if base is None else np.array(base, dtype=float)
        for name, angle in angles.items():
            q[self.joint_index(name)] = angle
        return q

    def full_configuration(self, q: Array) -> Array:
        """Return the angles of all URDF joints of a posture.

        Args:
            q: Independent joint angles [rad], of shape (n_q,).

        Returns:
            All joint angles in the order of the Pinocchio model [rad], of shape (nv,).
        """
        return self.coupling @ q + self.coupling_offset

    def contact_frames(self, set_name: str | None = None) -> tuple[ContactFrame, ...]:
        """Return the contact frames of one set.

        Args:
            set_name: Name of the set, the first one if left out; ``name:contact,contact`` takes only some of its
                contacts.

        Returns:
            The frames, in the order of the description.

        Raises:
            NameNotFoundError: If there is no such set or contact.
            InvalidValueError: If the hand has no contact frames at all.
        """
        sets = self.description.contact_sets
        if not sets or not all(sets.values()):
            raise InvalidValueError(f"contact_sets of hand {self.name}", {}, "at least one set with a contact frame")
        name = set_name if set_name is not None else next(iter(sets))
        if name not in sets:
            raise NameNotFoundError("contact set", name, sets)
        return tuple(find_contact_frame(self.model, label, entry) for label, entry in sets[name].items())

    def centre_of_grasp(self, set_name: str | None = None) -> Array:
        """Return where the middle of an object sits that is held by a contact set, in P [m], of shape (3,)."""
        name = set_name if set_name is not None else next(iter(self.description.contact_sets), "")
        given = self.description.grasp_centres.get(name)
        return self.grasp_centre if given is None else finite_array(f"grasp_centres.{name}", given, (3,))

    @property
    def max_normal_force(self) -> float:
        """Largest normal force of a contact, from the description [N]; infinite if it names none."""
        given = self.description.limits.normal_force
        return np.inf if given is None else given

    @cached_property
    def fitted_meshes(self) -> dict[str, FittedCapsules | FittedHull]:
        """What holds each mesh of the collision geometry, in its frame, by the name of the geometry."""
        fitted: dict[tuple[str, tuple[float, ...]], FittedCapsules | FittedHull] = {}
        found = {}
        for entry in self.collision_model.geometryObjects:
            if isinstance(entry.geometry, coal.BVHModelBase):
                key = entry.meshPath or entry.name, tuple(np.array(entry.meshScale).tolist())
                if key not in fitted:
                    fitted[key] = fit_mesh(entry.geometry)
                found[entry.name] = fitted[key]
        return found

    @cached_property
    def solids(self) -> HandSolids:
        """The collision geometries, with what does not change when they move."""
        return HandSolids.of(self.model, self.collision_model, self.description.collision.ignore)

    @cached_property
    def torque_limits(self) -> Array:
        """Effort limits of the independent joints in the URDF [N m], infinite where there is none, of shape (n_q,).

        A joint that others mimic drives them too; its own limit is that of its motor.
        """
        model = self.model
        index = [model.joints[model.getJointId(name)].idx_v for name in self.joint_names]
        effort = np.array(model.effortLimit)[index]
        return readonly(np.where(effort > 0.0, effort, np.inf))

    @cached_property
    def joint_compliance(self) -> Array:
        """Default C_q of the independent joints, from the description [rad/(N m)], of shape (n_q,) or (n_q, n_q).

        Raises:
            NameNotFoundError: If the description names a joint that is not independent.
            InvalidValueError: If it leaves one out, or a matrix is not symmetric positive definite or of another size.
        """
        given = self.description.compliance.joint
        if isinstance(given, tuple):
            return positive_definite(f"compliance.joint of hand {self.name}", given, self.n_joints)
        if not isinstance(given, dict):
            return readonly(np.full(self.n_joints, given))
        for name in given:
            self.joint_index(name)
        missing = [name for name in self.joint_names if name not in given]
        if missing:
            raise InvalidValueError(f"compliance.joint of hand {self.name}", missing, "a value for every joint")
        return readonly([given[name] for name in self.joint_names])

    @cached_property
    def tendons(self) -> Tendons | None:
        """The tendons that drive the hand by force; None for a hand without."""
        described = self.description.tendons
        if described is None:
            return None
        arms = np.array([self.posture(motor.arms) for motor in described.motors.values()])
        field, limits = f"tendons of hand {self.name}", (self.lower, self.upper)
        rest, compliance = self.posture(described.rest), self.joint_compliance
        return described_tendons(field, described, self.joint_names, arms, rest, limits, compliance)

    def synergies(self, set_name: str | None = None, compliance: Array | None = None) -> SynergySpace:
        """Return a synergy set of the hand, in the order of its joints.

        Args:
            set_name: Name of the set, ``tendons``, ``motors`` or ``closing``, or a CSV file; the default if left out.
            compliance: C_q that the tendons bend [rad/(N m)], of shape (n_q,) or (n_q, n_q); the hand's if left out.

        Returns:
            All synergies of the set; take the first n with ``truncated(n)``.

        Raises:
            NameNotFoundError: If there is no such set.
            InvalidValueError: If none is named and the hand has no default.
            FileFormatError: If its file is malformed.
        """
        files = self.description.synergies
        name = set_name if set_name is not None else files.default
        if name is None:
            raise InvalidValueError(
                f"synergies of hand {self.name}",
                None,
                "a set and its name as default in [synergies] of its description",
            )
        if name in files.sets:
            return load_synergies(self.folder / files.sets[name]).reordered(self.joint_names)
        if name == TENDONS and self.tendons is not None:
            return self.tendons.synergies(self.joint_names, self.joint_compliance if compliance is None else compliance)
        if name == MOTORS:
            return motor_synergies(self.joint_names, self._closing_set.mean)
        if name == CLOSING:
            return self._closing_set
        if (path := Path(name)).suffix == ".csv" and path.is_file():
            return load_synergies(path).reordered(self.joint_names)
        raise NameNotFoundError("synergy set", name, dict.fromkeys((*self.synergy_set_names, MOTORS, CLOSING)))

    @cached_property
    def _closing_set(self) -> SynergySpace:
        """The synergies made from how the fingers close."""
        motion = HandMotion(
            self.model,
            self.collision_model,
            self.joint_names,
            self.coupling,
            self.coupling_offset,
            self.lower,
            self.upper,
        )
        fingers, _ = find_fingers(motion)
        if not fingers:
            raise InvalidValueError(f"synergies of hand {self.name}", CLOSING, "fingers that close, or a set of a file")
        return closing_synergies(find_closing(motion, fingers))
