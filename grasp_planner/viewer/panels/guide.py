"""The tab *Guide*: the tour again, and the glossary."""

from __future__ import annotations

import viser

from ..glossary import glossary_table
from ..page_script import send_script
from ..tour import AGAIN


def add_guide(gui: viser.GuiApi) -> None:
    """Add the widgets to the present container."""
    again = gui.add_button("Show the tour", icon=viser.Icon.MAP_2, hint="Six steps through the chapters")
    again.on_click(lambda event: None if event.client is None else send_script(event.client, AGAIN))
    gui.add_markdown(glossary_table())
