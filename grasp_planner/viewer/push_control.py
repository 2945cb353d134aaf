"""Trying pushes on the page; all for the worker's thread."""

from __future__ import annotations

import numpy as np

from ..spatial import Array
from .panels.why import WhyPanel
from .push import push_from
from .session import Session


class PushControl:
    """Takes pushes from the widgets and from the dragged ball into the session."""

    def __init__(self, session: Session, panel: WhyPanel) -> None:
        self._session, self._panel = session, panel

    def apply(self) -> None:
        """Try a push as the widgets say, at first from where the grasp is weakest."""
        session, panel = self._session, self._panel
        weakest = session.grasp.passive_margin.direction[:3]
        way = weakest if session.push is None or not session.push.any() else session.push
        session.push = panel.size.value * way / np.linalg.norm(way) if panel.push.value else None
        session.dirty = True

    def drag(self, point: Array) -> None:
        """Try the push whose arrow begins at a point in the world [m]."""
        push = push_from(np.array(self._session.live.object_pose.inverse().act(point)))
        self._session.push = push * min(1.0, self._panel.size.max / max(float(np.linalg.norm(push)), 1e-9))
        self._session.dirty = True
