"""Contacts elsewhere on the last link than on its pad: on its sides, its edges, its end.

The pad of a finger is often flat in the middle and round beside it. Where its other places serve, a ball that is about
the whole fingertip finds them, and the widest patch around a normal is a contact there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from ..exceptions import InvalidValueError
from ..spatial import Array
from .closing import unit
from .contact_frame import SKIN, ContactFrame
from .description import ContactDescription, PatchDescription
from .fingertips import rounded
from .geometry_mesh import link_points
from .hand import Hand
from .hull_fit import surface_distance
from .pads import FITS, fitted_ball, patch_normals, radians

AROUND = 40.0
"""Angle to both sides of a pad's normal over which one ball stands for the whole fingertip [degrees]."""
BENDS = (2, 3, 4, 6, 8, 11, 15, 20, 28)
"""Angles of a patch to both sides of its middle about one axis [degrees] …"""
SIDES = (2, 3, 4, 6, 8, 12)
"""… and along it."""
ACROSS = 0.3
"""Length that an axis keeps beside a normal to be an axis of its patch."""


class Skin:
    """The surface of the link that carries a contact with a patch.

    Attributes:
        frame: The contact.
    """

    def __init__(self, hand: Hand, frame: ContactFrame) -> None:
        if frame.patch is None:
            raise InvalidValueError(f"patch of contact {frame.name}", None, "a contact with a patch")
        self.frame, self._patch = frame, frame.patch
        self._solids = [e for e in hand.collision_model.geometryObjects if int(e.parentJoint) == frame.joint_id]
        points = link_points(self._solids)
        self._points = points[ConvexHull(points).vertices]
        self._placement = hand.model.frames[frame.frame_id].placement

    def whole(self) -> ContactDescription:
        """Return a contact that may touch all around the pad, with a ball that is its surface only roughly."""
        normal, across = np.array(self._patch.normal), np.array(self._patch.across)
        normals = patch_normals(normal, np.cross(across, normal), AROUND, AROUND)
        centre, radius, _ = fitted_ball(self._points, normals)
        return self._described(centre, radius, normal, across, AROUND, AROUND)

    def about(self, normal: Array) -> ContactDescription | None:
        """Return the contact with the widest patch around a normal; None if no ball is the surface there.

        Args:
            normal: Outward normal in the frame of the joint, of shape (3,).
        """
        across = np.array(self._patch.across)
        along, best, found = np.cross(across, self._patch.normal), 0.0, None
        for axis in (across, along, across + along, across - along):
            beside = axis - (axis @ normal) * normal
            if np.linalg.norm(beside) < ACROSS:
                continue
            upright = unit(beside)
            for side in SIDES:
                for bend in (each for each in BENDS if each * side > best):
                    normals = patch_normals(normal, np.cross(upright, normal), bend, side)
                    centre, radius, error = fitted_ball(self._points, normals)
                    if error > FITS:
                        break
                    touching = centre + radius * normals
                    if max(surface_distance(self._solids, point) for point in touching) < SKIN:
                        best, found = bend * side, self._described(centre, radius, normal, upright, bend, side)
        return found

    def _described(
        self, centre: Array, radius: float, normal: Array, across: Array, bend: float, side: float
    ) -> ContactDescription:
        """Return the description of a patch in the frame of the joint, angles in degrees."""
        back = self._placement.rotation.T
        return ContactDescription(
            frame=self.frame.frame,
            radius=round(radius, 6),
            offset=rounded(self._placement.actInv(centre)),
            normal=rounded(back @ normal),
            patch=PatchDescription(across=rounded(back @ across), bend=radians(bend), side=radians(side)),
        )


def with_contact_sets(hand: Hand, sets: dict[str, dict[str, ContactDescription]]) -> Hand:
    """Return a hand with other contact sets, by name; what was fitted to its meshes is kept."""
    changed = replace(hand, description=hand.description.model_copy(update={"contact_sets": sets}))
    vars(changed)["fitted_meshes"] = hand.fitted_meshes
    return changed
