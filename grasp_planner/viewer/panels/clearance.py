"""The widgets of what has to keep clear of what."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from ...problem.clearance_options import LINK_OBJECT_MODES, ClearanceOptions
from .widgets import set_value


class ClearancePanel:
    """Widgets of :class:`ClearanceOptions`."""

    def __init__(self, gui: viser.GuiApi, changed: Callable[[], None]) -> None:
        standard = ClearanceOptions()
        self.widgets: dict[str, Any] = {
            "link_object": gui.add_dropdown("Links and object", LINK_OBJECT_MODES, initial_value=standard.link_object),
            "self_collision": gui.add_checkbox("Fingers clear of each other", standard.self_collision),
            "tip_patch": gui.add_checkbox("Touch with the tip only", standard.tip_patch),
            "remark1": gui.add_checkbox("Fingers keep their order", standard.remark1, hint="Remark 1 of the paper"),
            "margin": gui.add_number("Margin [m]", standard.margin, min=0.0, max=0.05, step=1e-4),
        }
        for widget in self.widgets.values():
            widget.on_update(lambda _: changed())

    def options(self, base: ClearanceOptions) -> ClearanceOptions:
        """Return what the widgets ask for; the ground stays as it is."""
        chosen = {name: widget.value for name, widget in self.widgets.items()}
        return ClearanceOptions(**chosen, ground=base.ground)

    def show(self, options: ClearanceOptions) -> None:
        """Show options; to be called by the worker only."""
        for name, widget in self.widgets.items():
            set_value(widget, getattr(options, name))
