"""Widgets made from settings: numbers with unit and bounds, boxes, choices, and texts for everything else."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import viser

from ...problem.settings import Setting, settings_of
from .widgets import Pause, TextField, set_value

UNDECIDED, YES, NO = "as needed", "yes", "no"
"""Choices of a truth value that may be left open."""


class SettingsPanel:
    """Widgets of the settings of a dataclass; what they were not told to change they leave alone.

    Attributes:
        widgets: The widgets by name of the field.
    """

    def __init__(
        self, gui: viser.GuiApi, owner: type, changed: Callable[[], None], without: Iterable[str] = ()
    ) -> None:
        self._settings = {each.name: each for each in settings_of(owner) if each.name not in set(without)}
        self._fields: dict[str, TextField] = {}
        self.widgets: dict[str, Any] = {name: self._add(gui, each) for name, each in self._settings.items()}
        self._shown = {name: widget.value for name, widget in self.widgets.items()}
        self._read = self._shown
        typed = Pause(changed)
        for name, widget in self.widgets.items():
            is_typed = name in self._fields or _is_number(self._settings[name])
            widget.on_update(typed if is_typed else lambda _: changed())

    def _add(self, gui: viser.GuiApi, each: Setting) -> Any:
        """Add the widget of a setting."""
        widget = _widget(gui, each)
        if isinstance(widget, TextField):
            self._fields[each.name] = widget
            return widget.widget
        return widget

    def changes(self) -> dict[str, Any]:
        """Return the fields that were changed on the page.

        Raises:
            FieldError: If a text can't be read or is out of range.
        """
        self._read = {name: widget.value for name, widget in self.widgets.items()}
        found = {}
        for name, value in self._read.items():
            if value != self._shown[name]:
                found[name] = self._value(self._settings[name], value)
            elif name in self._fields:
                self._fields[name].complain("")
        return found

    def _value(self, each: Setting, shown: Any) -> Any:
        """Return the value of what a widget shows."""
        if each.name in self._fields:
            return self._fields[each.name].read(str(shown), lambda text: each.checked(each.of_text(text)))
        return _value(each, shown)

    def options(self, base: Any) -> Any:
        """Return options as the widgets say.

        Args:
            base: The present ones, of the dataclass.

        Raises:
            GraspPlannerError: If a value is out of range.
        """
        return replace(base, **self.changes())

    def settle(self) -> None:
        """Take what :meth:`changes` read for what holds; what was changed since then is still to be read."""
        self._shown = self._read

    def enter(self, options: Any) -> None:
        """Have the widgets ask for options, as if they were typed."""
        for name, widget in self.widgets.items():
            set_value(widget, _shown(self._settings[name], getattr(options, name)))

    def show(self, options: Any) -> None:
        """Show options; to be called by the worker only."""
        for field in self._fields.values():
            field.complain("")
        self.enter(options)
        for name, widget in self.widgets.items():
            self._shown[name] = widget.value


def _widget(gui: viser.GuiApi, each: Setting) -> Any:
    """Return the widget of a setting."""
    label = each.name.removesuffix("_s").replace("_", " ").capitalize() + (f" [{each.unit}]" if each.unit else "")
    hint = f"{each.help.rstrip('.')}; {each.allowed}" if each.kind != "choice" else each.help.rstrip(".")
    if each.kind == "truth":
        if each.none:
            return gui.add_dropdown(label, (UNDECIDED, YES, NO), hint=hint)
        return gui.add_checkbox(label, each.default, hint=hint)
    if each.kind == "choice":
        undecided = (UNDECIDED,) if each.none else ()
        return gui.add_dropdown(
            label, undecided + each.choices, initial_value=str(_shown(each, each.default)), hint=hint
        )
    if _is_number(each):
        return gui.add_number(label, each.default, min=each.low, max=each.high, step=each.step, hint=hint)
    empty = f"; empty: {each.none}" if each.none else ""
    return TextField(gui, label, each.text(each.default), hint + empty)


def _is_number(each: Setting) -> bool:
    """Return whether a setting has a number input."""
    return each.kind in ("number", "whole") and each.step is not None and not each.none and not each.each_of


def _value(each: Setting, shown: Any) -> Any:
    """Return the value of what a widget shows."""
    if each.kind == "truth":
        return {UNDECIDED: None, YES: True, NO: False}[shown] if each.none else bool(shown)
    if each.kind == "choice":
        return None if each.none and shown == UNDECIDED else shown
    if _is_number(each):
        return int(shown) if each.kind == "whole" else float(shown)
    return shown


def _shown(each: Setting, value: Any) -> Any:
    """Return what a widget shows for a value."""
    if each.kind == "truth" and each.none:
        return UNDECIDED if value is None else YES if value else NO
    if each.kind == "choice" and value is None:
        return UNDECIDED
    if each.kind in ("truth", "choice") or _is_number(each):
        return value
    return each.text(value)
