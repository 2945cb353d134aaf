"""The first tab: why the grasp holds, its numbers, closing it, comparing it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import viser

from ...grasp.grasp import Grasp
from ...values import number_text
from .. import text
from ..legend import LEGEND
from ..live import contact_share
from ..scene.clearances import link_clearances
from ..session import Session
from .chapters import GRASP, add_about


@dataclass(frozen=True)
class GraspFolder:
    """A folder of the tab with a text about the grasp.

    Attributes:
        title: Its heading.
        words: Gives the text (Markdown) for a grasp and whether its fingertips touch, so that there are forces.
        open: Whether it is open at first.
        waits: Whether it takes so long that it is told only once nothing moves.
    """

    title: str
    words: Callable[[Grasp, bool], str]
    open: bool = False
    waits: bool = False


BLOCKS = (
    GraspFolder("Contacts", lambda grasp, touching: text.contact_table(grasp, in_contact=touching), open=True),
    GraspFolder("All requirements", lambda grasp, _: text.violation_table(grasp)),
    GraspFolder("Measures", lambda grasp, touching: text.measure_table(grasp, in_contact=touching), waits=True),
    GraspFolder("Joints and torques", lambda grasp, _: text.joint_table(grasp)),
)
"""All folders, in their order; to tell more about a grasp, add one."""

LATER = "*as soon as the hand rests*"
"""What a folder that waits says."""


@dataclass
class GraspPanel:
    """Widgets of the first tab.

    Attributes:
        play: Button that plays the closing.
    """

    play: viser.GuiButtonHandle
    _story: viser.GuiMarkdownHandle
    _selected: viser.GuiMarkdownHandle
    _blocks: list[viser.GuiMarkdownHandle]
    _told: Grasp | None = None

    @classmethod
    def add(cls, gui: viser.GuiApi) -> GraspPanel:
        """Add the widgets to the present container."""
        add_about(gui, GRASP)
        gui.add_html(LEGEND)
        play = gui.add_button("Play closing", icon=viser.Icon.PLAYER_PLAY, hint="Open the hand and close it again")
        story = gui.add_markdown("")
        selected = gui.add_markdown("")
        blocks = []
        for block in BLOCKS:
            with gui.add_folder(block.title, expand_by_default=block.open):
                blocks.append(gui.add_markdown(""))
        return cls(play, story, selected, blocks)

    def show(self, session: Session) -> None:
        """Show the numbers of the grasp."""
        grasp = session.grasp
        touching = contact_share(grasp) > 0.0
        self._story.content = text.why_story(grasp)
        for block, widget in zip(BLOCKS, self._blocks, strict=True):
            if not block.waits:
                widget.content = block.words(grasp, touching)
            elif self._told is not grasp:
                widget.content = LATER
        self._selected.content = self._details(session, grasp)

    def climb(self, session: Session) -> bool:
        """Tell of the grasp what has waited, while nothing moves; return whether there was anything."""
        grasp = session.grasp
        if self._told is grasp or session.preview is not None:
            return False
        self._told, touching = grasp, contact_share(grasp) > 0.0
        for block, widget in zip(BLOCKS, self._blocks, strict=True):
            if block.waits:
                widget.content = block.words(grasp, touching)
        return True

    def _details(self, session: Session, grasp: Grasp) -> str:
        """Return the numbers of what was clicked."""
        if session.selected is None:
            return ""
        kind, which = session.selected
        if kind == "contact" and isinstance(which, int) and which < len(grasp.problem.frames):
            return text.contact_details(grasp, which)
        return link_details(grasp, str(which))


def link_details(grasp: Grasp, link: str) -> str:
    """Return the numbers of a link (Markdown): its joint, limits, torque, contacts and clearances."""
    hand = grasp.problem.hand
    lines = [f"**Link {link}**", ""]
    frame = hand.model.frames[hand.model.getFrameId(link, pin.FrameType.BODY)]
    joint = frame.parentJoint
    if joint:
        name = hand.model.names[joint]
        full = hand.full_configuration(grasp.joint_angles)
        angle = np.degrees(full[hand.model.joints[joint].idx_q])
        lines.append(f"- turned by joint {name}: {angle:.1f}°")
        if name in hand.joint_names:
            index = hand.joint_index(name)
            lower, upper = np.degrees(hand.lower[index]), np.degrees(hand.upper[index])
            lines.append(f"- its limits: {lower:.0f}° to {upper:.0f}°")
            lines.append(f"- its torque: {1e3 * grasp.joint_torques[index]:.1f} mN m")
    clearance = link_clearances(grasp).get(link)
    if clearance is not None:
        lines.append(f"- clearance: {1e3 * clearance[0]:.2f} mm from {clearance[1]}")
    for index, contact in enumerate(grasp.problem.frames):
        if contact.link == link:
            lines.append(f"- touches as *{contact.name}* with {number_text(float(grasp.normal_forces[index]))} N")
    return "\n".join(lines)
