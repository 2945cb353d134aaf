"""The table of `analyse --tolerance`: how far palm, size, friction and mass may be off for the hand still to close."""

from __future__ import annotations

from rich.console import Console

from ..analysis.closing_tolerance import ClosingTolerance, Loss, closing_tolerances, static_loss
from ..grasp.grasp import Grasp
from .margins import new_table


def print_closing_tolerances(console: Console, grasp: Grasp, directions: int, seed: int, simulated: bool) -> None:
    """Find the tolerances of a closing hand and print them.

    Args:
        console: Where to.
        grasp: The grasp.
        directions: Directions in which the palm is off.
        seed: Their seed.
        simulated: Whether simulation judges, not statics.
    """
    loss: Loss = static_loss
    if simulated:
        from ..simulate import simulated_loss

        loss = simulated_loss
    with console.status("closing with errors …"):
        found = closing_tolerances(grasp, seed=seed, samples=directions, loss=loss)
    judge = "simulated" if simulated else "by statics"
    title = f"tolerance of closing, {judge}: how far one thing may be off, the palm along {directions} directions"
    table = new_table(title, ("", "holds up to", "lost at", "what goes wrong there"))
    table.columns[-1].justify, table.columns[-1].no_wrap = "left", False
    for each in found:
        table.add_row(each.name, _amount(each, each.held), _amount(each, each.lost), each.cause)
    console.print(table)


def _amount(found: ClosingTolerance, value: float | None) -> str:
    """Return an error with its unit."""
    if value is None:
        return "–"
    return f"× {value:.2f}" if found.unit == "×" else f"{value:.2f} {found.unit}"
