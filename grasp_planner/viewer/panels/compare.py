"""The chapter *Compare*: series of problems, a pinned grasp, figures of the paper."""

from __future__ import annotations

from collections.abc import Callable

import viser

from ..compare import compare_table
from ..presets import paper_presets
from ..session import Session
from .chapters import COMPARE, add_about
from .gallery import GalleryPanel

NOTHING_PINNED = "*Pin a grasp, then plan or move: both are drawn and listed side by side.*"


class ComparePanel:
    """Widgets of the chapter.

    Attributes:
        pin: Button that pins the grasp for comparison.
        unpin: Button that forgets it.
        preset: The figure of the paper that is chosen.
        show_preset: Button that plans it.
        series: What is compared.
        plan_series: Button that plans it.
        stop: Button that ends that.
        status: How far it is.
        gallery: A card for each problem of the series.
    """

    def __init__(self, gui: viser.GuiApi, series: tuple[str, ...], chosen: Callable[[int], None]) -> None:
        """Add the widgets to the present container.

        Args:
            gui: The widgets of the page.
            series: Names of what can be compared.
            chosen: Called with the index of a card that was clicked.
        """
        add_about(gui, COMPARE)
        self.series = gui.add_dropdown("This task with", series)
        self.plan_series = gui.add_button("Plan them all", icon=viser.Icon.ROCKET, hint="Each for 20 s at most")
        self.stop = gui.add_button("Stop", color="red", disabled=True)
        self.status = gui.add_markdown("")
        self.gallery = GalleryPanel(gui, chosen, "Side by side")
        with gui.add_folder("With a pinned grasp"):
            self.pin = gui.add_button("Pin this grasp", icon=viser.Icon.PIN, hint="Keep it as a ghost to compare with")
            self.unpin = gui.add_button("Unpin", visible=False)
            self.compared = gui.add_markdown(NOTHING_PINNED)
        with gui.add_folder("With the paper"):
            self.preset = gui.add_dropdown("Figures of the paper", tuple(paper_presets()))
            self._about = gui.add_markdown("")
            self.show_preset = gui.add_button("Plan this figure", icon=viser.Icon.PHOTO)
        self.preset.on_update(lambda _: self._describe_preset())
        self._describe_preset()

    def show(self, session: Session) -> None:
        """Show the grasp beside the pinned one; to be called by the worker only."""
        pinned = session.pinned
        self.unpin.visible = pinned is not None
        self.compared.content = NOTHING_PINNED if pinned is None else compare_table(session.grasp, pinned)

    def _describe_preset(self) -> None:
        """Say what the chosen figure shows."""
        self._about.content = paper_presets()[self.preset.value].about
