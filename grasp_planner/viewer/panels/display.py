"""The tab of what is shown."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import viser

from ..scene.draw_grasp import DisplayOptions

BOXES = (
    ("object", "Object", "The object"),
    ("contacts", "Contact points", "Dots; click one for its numbers"),
    ("labels", "Names of the contacts", ""),
    ("normals", "Contact normals", ""),
    ("cones", "Friction cones", "Green: the force is inside. Red: the finger would slip"),
    ("forces", "Contact forces", "Of the hand on the object"),
    ("weight", "Weight", ""),
    ("task", "Task direction", "Drag the green ball to turn it"),
    ("force_ellipsoid", "Force ellipsoid", "Forces per unit of synergy effort: long where the hand is strong"),
    ("torque_ellipsoid", "Torque ellipsoid", "The same for torques"),
    ("velocity_ellipsoid", "Velocity ellipsoid", "Motions per unit of synergy speed; needs 6 synergies"),
    ("stiffness_ellipsoid", "Stiffness ellipsoid", "Newtons per mm of a shift: long where the springs hold stiffly"),
    ("torques", "Joint torques", "Arrows along the joint axes"),
    ("reference_ghost", "Reference posture q_r", "Where the synergies alone would put the hand; springs do the rest"),
    ("seed_ghost", "Start of the search", ""),
    ("pinned_ghost", "Pinned grasp", ""),
    ("clearances", "Clearances", "Lines between the closest parts; links that penetrate turn red"),
)


class DisplayPanel:
    """Check boxes of everything drawn, and the scale of forces."""

    def __init__(
        self,
        gui: viser.GuiApi,
        changed: Callable[[], None],
        force_scale: float,
        elsewhere: Mapping[str, viser.GuiCheckboxHandle],
    ) -> None:
        """Add the widgets to the present container.

        Args:
            gui: The widgets of the page.
            changed: Called when one of them has changed.
            force_scale: Length of force arrows to begin with [mm/N].
            elsewhere: Boxes that stand in the chapter they belong to, by the name of their option.
        """
        initial = DisplayOptions()
        self.look = gui.add_button("Look at the grasp", icon=viser.Icon.FOCUS_CENTERED, hint="From where most is seen")
        self.dark = gui.add_checkbox("Dark", False, hint="Light writing on a dark ground")
        self.boxes: dict[str, viser.GuiCheckboxHandle] = {}
        for name, label, hint in BOXES:
            self.boxes[name] = gui.add_checkbox(label, bool(getattr(initial, name)), hint=hint or None)
        self.force_scale = gui.add_slider("Force arrows mm/N", 5.0, 150.0, 1.0, force_scale)
        self.notes = gui.add_markdown("")
        self.boxes |= elsewhere
        for widget in self.boxes.values():
            widget.on_update(lambda _: changed())
        self.force_scale.on_update(lambda _: changed())

    def on_dark(self, *takers: Callable[[bool], None]) -> None:
        """Tell others when the page is to be dark, or light again."""

        def tell(_: object) -> None:
            for take in takers:
                take(self.dark.value)

        self.dark.on_update(tell)

    @property
    def options(self) -> DisplayOptions:
        """What the widgets say."""
        chosen = {name: box.value for name, box in self.boxes.items()}
        return DisplayOptions(**chosen, force_scale=self.force_scale.value)

    def show(self, notes: list[str]) -> None:
        """Show what the ellipsoids are."""
        self.notes.content = "\n\n".join(f"*{note}*" for note in notes)
