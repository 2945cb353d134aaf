"""The widgets of the problem: task, object, hand and contacts, and its settings, folder by folder."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import fields, replace
from typing import Any

import numpy as np
import viser

from ...exceptions import GraspPlannerError
from ...hand.description import hand_library
from ...hand.hand import Hand
from ...hand.loading import load_hand
from ...model.task_direction import TaskDirection, parse_task
from ...objects import SHAPES, GraspObject
from ...problem.clearance_options import ClearanceOptions
from ...problem.load_cases import LoadCases
from ...problem.parameters import PAPER_WEIGHTS, GraspParameters
from ...problem.problem import GraspProblem
from ...problem.synergy_number import MOTION_SYNERGIES, default_synergies
from ..choices import size_range, usable_synergy_sets
from ..session import Session
from .settings import SettingsPanel
from .widgets import Pause, TextField, log10, set_value

PICKED = ("hand", "kind")
"""Choices that change much and take long, so that another may be made meanwhile."""
AXES = ("+x", "−x", "+y", "−y", "+z", "−z")


class ProblemPanel:
    """Widgets that say what the problem is; what they were not told to change they leave alone.

    Attributes:
        typed: Takes what was typed once typing pauses, or at once.
        notes: What the last change had to change besides, in words.
    """

    def __init__(
        self, gui: viser.GuiApi, changed: Callable[[], None], task: AbstractContextManager[Any] | None = None
    ) -> None:
        """Add the widgets to the present container.

        Args:
            gui: The widgets of the page.
            changed: Called when one of them has changed.
            task: Another container for those of the task; a folder here if left out.
        """
        self._gui, self._changed, self._version = gui, changed, -1
        self.typed = Pause(changed)
        self.notes: list[str] = []
        self._synced: dict[str, Any] = {}
        self._forced = False
        with gui.add_folder("Task") if task is None else task:
            self._add_task()
        with gui.add_folder("Object"):
            self.kind = gui.add_dropdown("Shape", tuple(SHAPES))
            self._object_folder = gui.add_folder("Sizes [m], [kg]")
            self._sizes: dict[str, viser.GuiNumberHandle[float]] = {}
        with gui.add_folder("Hand", expand_by_default=False):
            self._add_hand()
        with gui.add_folder("Clearances", expand_by_default=False):
            self.clearance = SettingsPanel(gui, ClearanceOptions, self._changed)
        with gui.add_folder("Load cases", expand_by_default=False):
            self.loads = SettingsPanel(gui, LoadCases, self._changed)
        with gui.add_folder("Weights and model", expand_by_default=False):
            self.weight_ratio = gui.add_slider(
                "log₁₀ w_F/w_C", -9.0, 0.0, 0.25, -6.0, hint="Sets both weights; empty weights below: least force first"
            )
            self.weight_ratio.on_update(lambda _: self._changed())
            self.parameters = SettingsPanel(gui, GraspParameters, self._changed)
        self.kind.on_update(lambda _: self._changed())

    def problem(self, base: GraspProblem) -> GraspProblem:
        """Return the problem that the widgets ask for; what they can't say stays as it is.

        Args:
            base: The present problem.

        Raises:
            GraspPlannerError: If they ask for something impossible.
        """
        values = self._values()
        changed = {name for name, value in values.items() if self._synced.get(name) != value}
        hand = load_hand(values["hand"]) if "hand" in changed else base.hand
        changes: dict[str, Any] = {
            "hand": hand,
            "grasp_object": self._object(base, values, changed),
            "tasks": self._tasks(base, values, changed),
            "clearance": self.clearance.options(base.clearance),
            "loads": self.loads.options(base.loads),
            "parameters": self._model(base, hand, values, changed),
        }
        changes |= self._sets(base, hand, values, changed)
        self.notes = []
        self._reconcile(base, hand, changes)
        problem = replace(base, **changes)
        self._synced.update(values)
        for panel in (self.clearance, self.loads, self.parameters):
            panel.settle()
        return problem

    def _sets(self, base: GraspProblem, hand: Hand, values: dict[str, Any], changed: set[str]) -> dict[str, Any]:
        """Return the changes of synergies and contacts; a new hand brings its own."""
        if hand is not base.hand:
            usual = base.n_synergies == default_synergies(base.hand, base.synergy_set_name)
            count = None if usual else base.n_synergies
            own = dict.fromkeys(("synergy_set", "contact_set", "contacts", "synergy_space"))
            return {"n_synergies": count, **own}
        changes: dict[str, Any] = {}
        if "synergy_set" in changed:
            changes |= {"synergy_set": values["synergy_set"], "synergy_space": None}
        if "contact_set" in changed:
            changes |= {"contact_set": values["contact_set"], "contacts": None}
        elif "contacts" in changed:
            changes["contacts"] = values["contacts"]
        return changes

    def _reconcile(self, base: GraspProblem, hand: Hand, changes: dict[str, Any]) -> None:
        """Fit the number of synergies to hand, set and tasks, and note what that changed."""
        count = changes.get("n_synergies", base.n_synergies)
        name = changes.get("synergy_set", base.synergy_set) or hand.description.synergies.default_for(
            changes["clearance"].needs_geometry
        )
        space = changes.get("synergy_space", base.synergy_space)
        most = hand.synergies(name).n_synergies if space is None else space.n_synergies
        fitting = count if count is None else min(count, most)
        if any(task.is_motion for task in changes["tasks"]) and (fitting or 0) < MOTION_SYNERGIES <= most:
            fitting = MOTION_SYNERGIES
        if fitting != count:
            changes["n_synergies"] = fitting
            self.notes.append(f"n_s is {fitting} now: the set has {most}, and a twist needs {MOTION_SYNERGIES}")
        if hand is not base.hand:
            self.notes.append("the hand brings its own synergies and contacts")

    def _values(self) -> dict[str, Any]:
        """Return what all widgets say at this moment."""
        values: dict[str, Any] = {
            "hand": self.hand.value,
            "synergy_set": self.synergy_set.value,
            "contact_set": self.contact_set.value,
            "contacts": self._chosen_contacts(),
            "kind": self.kind.value,
            "task_kind": self.task_kind.value,
            "direction": self.direction.value,
            "more": self.more.value,
            "weight_ratio": self.weight_ratio.value,
        }
        return values | {f"size {name}": widget.value for name, widget in self._sizes.items()}

    def show(self, session: Session, *, force: bool = False) -> None:
        """Show the problem; to be called by the worker only."""
        if self._version == session.problem_version and not force:
            return
        self._version, self._forced = session.problem_version, force
        self._more.complain("")
        problem = session.problem
        self._sync_hand(problem)
        self._sync_object(problem.grasp_object)
        task = problem.tasks[0]
        self._set("task_kind", self.task_kind, task.kind)
        part = task.direction[3:] if task.kind == "torque" or not task.direction[:3].any() else task.direction[:3]
        self._set("direction", self.direction, tuple(float(round(value, 6)) for value in part))
        self._set("more", self.more, " ".join(entry.text for entry in problem.tasks[1:]))
        self.clearance.show(problem.clearance)
        self.loads.show(problem.loads)
        given = problem.parameters
        self.parameters.show(given)
        ratio = PAPER_WEIGHTS["force_weight"]  # the slider stays there without weights
        if given.force_weight is not None and given.task_weight is not None:
            ratio = given.force_weight / given.task_weight if given.task_weight > 0.0 else math.inf
        self._set("weight_ratio", self.weight_ratio, float(np.clip(log10(ratio), -9.0, 0.0)))

    def _add_task(self) -> None:
        """Add the widgets of the task."""
        gui = self._gui
        self.task_kind = gui.add_dropdown("Kind", ("force", "torque", "twist"), hint="twist: moving the object")
        self.axis = gui.add_button_group("Along", AXES)
        self.direction = gui.add_vector3(
            "Direction in O", (0.0, 1.0, 0.0), min=(-1.0,) * 3, max=(1.0,) * 3, step=0.01, hint="Or drag the ball"
        )
        self._more = TextField(gui, "More tasks", "", "For instance: torque:+z*0.5 force:+x")
        self.more = self._more.widget
        self.task_kind.on_update(lambda _: self._changed())
        self.direction.on_update(self.typed)
        self.more.on_update(self.typed)
        self.axis.on_click(lambda _: self._choose_axis())

    def _choose_axis(self) -> None:
        """Take a direction from its button."""
        chosen = str(self.axis.value)
        sign = -1.0 if chosen.startswith("−") else 1.0
        set_value(self.direction, tuple(sign * (chosen[1:] == name) for name in "xyz"))

    def _add_hand(self) -> None:
        """Add the widgets of hand, synergy set and contacts."""
        gui = self._gui
        self.hand = gui.add_dropdown("Hand", tuple(hand_library()))
        self.synergy_set = gui.add_dropdown("Synergies", ("",))
        self.contact_set = gui.add_dropdown("Contacts", ("",))
        self._finger_folder = gui.add_folder("Fingers that have to touch")
        self._fingers: dict[str, viser.GuiCheckboxHandle] = {}
        self.hand.on_update(lambda _: self._changed())
        self.synergy_set.on_update(lambda _: self._changed())
        self.contact_set.on_update(lambda _: self._changed())

    def _model(self, base: GraspProblem, hand: Hand, values: dict[str, Any], changed: set[str]) -> GraspParameters:
        """Return the parameters the widgets ask for; a new hand brings its own."""
        given = base.parameters.without_hand(base.hand)
        if "weight_ratio" in changed:
            given = replace(given, force_weight=10.0 ** values["weight_ratio"], task_weight=1.0)
        found: GraspParameters = self.parameters.options(given)
        return found

    def _object(self, base: GraspProblem, values: dict[str, Any], changed: set[str]) -> GraspObject:
        """Return the object the widgets ask for."""
        if "kind" in changed:
            try:
                return SHAPES[values["kind"]]()
            except TypeError:
                raise GraspPlannerError(f"a {values['kind']} has no standard sizes; load it from a file") from None
        sizes = {name: values[f"size {name}"] for name in self._sizes if f"size {name}" in changed}
        return replace(base.grasp_object, **sizes) if sizes else base.grasp_object

    def _sync_object(self, grasp_object: GraspObject) -> None:
        """Show shape and sizes."""
        self._set("kind", self.kind, grasp_object.kind)
        values = {field.name: getattr(grasp_object, field.name) for field in fields(grasp_object)}
        numbers = {name: float(value) for name, value in values.items() if isinstance(value, int | float)}
        values = {name: value for name, value in numbers.items() if math.isfinite(value)}  # infinite: no bound
        if tuple(values) != tuple(self._sizes):
            for widget in self._sizes.values():
                widget.remove()
            with self._object_folder:
                self._sizes = {name: self._size(name, value) for name, value in values.items()}
            for widget in self._sizes.values():
                widget.on_update(self.typed)
        for name, value in values.items():
            self._set(f"size {name}", self._sizes[name], value)

    def _size(self, name: str, value: float) -> viser.GuiNumberHandle[float]:
        """Return a new widget of a size; it begins with its value, if that is in its range."""
        limits = size_range(name)
        return self._gui.add_number(name, min(max(value, limits["min"]), limits["max"]), **limits)

    def _tasks(self, base: GraspProblem, values: dict[str, Any], changed: set[str]) -> tuple[TaskDirection, ...]:
        """Return the tasks the widgets ask for."""
        first = base.tasks[0]
        if changed & {"task_kind", "direction"}:
            numbers = ",".join(f"{value:.12g}" for value in values["direction"])
            first = replace(parse_task(f"{values['task_kind']}:{numbers}"), weight=first.weight)
        if "more" not in changed:
            return (first, *base.tasks[1:])
        more = self._more.read(values["more"], lambda text: tuple(parse_task(part) for part in text.split()))
        return (first, *more)

    def _sync_hand(self, problem: GraspProblem) -> None:
        """Show hand, synergy set and contacts."""
        hand = problem.hand
        names = tuple(hand_library())
        self.hand.options = names if hand.name in names else (*names, hand.name)
        self._set("hand", self.hand, hand.name)
        named = problem.synergy_set_name or ""
        usable = usable_synergy_sets(hand)
        self.synergy_set.options = usable if named in usable else (named, *usable)
        self._set("synergy_set", self.synergy_set, named)
        contacts = problem.contact_set_name
        self.contact_set.options = hand.contact_set_names
        self._set("contact_set", self.contact_set, contacts)
        names = tuple(frame.name for frame in hand.contact_frames(contacts))
        if names != tuple(self._fingers):
            for box in self._fingers.values():
                box.remove()
            with self._finger_folder:
                self._fingers = {name: self._gui.add_checkbox(name, True) for name in names}
            for box in self._fingers.values():
                box.on_update(lambda _: self._changed())
        for name, box in self._fingers.items():
            set_value(box, problem.contacts is None or name in problem.contacts)
        self._synced["contacts"] = self._chosen_contacts()

    def _chosen_contacts(self) -> tuple[str, ...] | None:
        """Return the contacts the widgets ask for; None for all."""
        chosen = tuple(name for name, box in self._fingers.items() if box.value)
        return None if len(chosen) == len(self._fingers) else chosen

    def _set(self, name: str, widget: Any, value: Any) -> None:
        """Show a value and remember that it is the problem's own."""
        if name in PICKED and not self._forced and widget.value != self._synced.get(name, widget.value):
            return  # picked on the page since the widgets were read: its own change is on its way
        set_value(widget, value)
        self._synced[name] = widget.value
