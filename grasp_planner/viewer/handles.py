"""Handles in the picture that move hand and object."""

from __future__ import annotations

from collections.abc import Callable

import viser

from .scene.draw_hand import pose_of
from .scene.picture3d import Picture
from .session import Session


def connect_handles(
    picture: Picture,
    session: Session,
    boxes: tuple[viser.GuiCheckboxHandle, viser.GuiCheckboxHandle],
    later: Callable[..., None],
) -> None:
    """Connect the handles with the poses they move.

    Args:
        picture: The picture that has them.
        session: The state they change.
        boxes: Check boxes that show them, for the hand and for the object.
        later: Has the worker do something, the newest of those with the same key.
    """
    hand, thing = picture.hand_gizmo, picture.object_gizmo
    for box in boxes:
        box.on_update(lambda _: later(lambda: picture.show_gizmos(*(each.value for each in boxes)), "gizmos"))
    hand.on_update(lambda _: later(lambda: session.set_hand_pose(pose_of(hand)), "hand"))
    thing.on_update(lambda _: later(lambda: session.set_object_pose(pose_of(thing)), "object"))
