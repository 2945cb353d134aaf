"""The chapters of the page: their names in order, and what each is about in a few words."""

from __future__ import annotations

import viser

GRASP, SYNERGIES, WHY, TASK, PLAN, COMPARE = CHAPTERS = (
    "Grasp",
    "Synergies",
    "Why it holds",
    "Task",
    "Plan",
    "Compare",
)
"""Names of the chapters, in their order."""
ABOUT = {
    GRASP: "<b>Does it hold, how hard, against what?</b> The card above climbs from the model on paper to a hand "
    "that closes; it is green as far as it is true. Click a contact or a finger for its numbers.",
    SYNERGIES: "<b>Few motors move many joints.</b> Drag <i>Close</i>: the fingers touch one after the other. The "
    "<span style='color:#965adc'>violet ghost</span> is where the motors alone would put them; the gap is a "
    "spring, and its newtons hold the object. Then drag σ1: one motor moves all fingers.",
    WHY: "<b>Every force has to stay inside its friction cone.</b> Push the object: the motors rest, the "
    "fingers answer by their springs and go from green to amber to red by the share of their friction that is used. "
    "Red slips. Inside the pale sphere a push from any side is held.",
    TASK: "<b>Where is the hand to be strong?</b> Drag the green ball to turn the task. The blue ellipsoid is long "
    "where the motors give much force for little effort; a small angle between both is a good grasp for the task.",
    PLAN: "<b>Say what is wanted, then plan.</b> The search runs beside the page; what it finds that differs gets "
    "a card, the best first. Nothing shown is called feasible that does not recompute as such.",
    COMPARE: "<b>What do more motors buy, and whose synergies?</b> Plan the same task several "
    "times over, or a figure of the paper, and click through what comes out.",
}
"""What each chapter is about (HTML)."""


def add_about(gui: viser.GuiApi, chapter: str) -> None:
    """Add what a chapter is about to the present container."""
    gui.add_html(f"<div style='font:13px/1.45 system-ui,sans-serif;margin:6px 12px'>{ABOUT[chapter]}</div>")
