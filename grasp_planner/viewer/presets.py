"""The figures of [Mavrogiannis2014] section IV as ready-made problems, with what they show."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..hand.loading import load_hand
from ..model.task_direction import parse_task
from ..objects import Cylinder
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem
from ..studies.paper_tables import PAPER_CELLS, PaperCell

BY_SYNERGIES = {
    1: "One motor command moves all fingers together. So the ellipsoid has no end in some directions (it is drawn "
    "cut open): there the hand resists with its structure and not with its motor.",
    2: "Two motor commands. The ellipsoid still has no end in some directions; there the motors can do nothing.",
    3: "Three motor commands, the fewest with which the ellipsoid ends in every direction; its long axis comes "
    "near the task.",
    15: "Every joint has its own motor: compare with three to see what the coupling costs in force and angle.",
}
"""What a figure shows, by its number of synergies."""
BY_RATIO = {
    1e-9: "Almost only the task counts: the long axis of the ellipsoid comes as near to the green arrow as the search "
    "finds, whatever the force.",
    1e-6: "Both count: the angle hardly grows, and the forces are lower.",
    1.0: "Almost only low force counts: the ellipsoid may lie across the task.",
}
"""What a figure shows, by its ratio of weights w_F/w_C."""
ENOUGH = 1
"""Feasible grasps after which the search for a figure ends, so that it takes seconds."""


@dataclass(frozen=True)
class Preset:
    """A problem of the paper.

    Attributes:
        cell: The paper's numbers.
    """

    cell: PaperCell

    @property
    def title(self) -> str:
        """What it is called on the page."""
        cell = self.cell
        if cell.table == 2:
            return f"weights w_F/w_C = {cell.weight_ratio:g}, {cell.n_synergies} synergies, {cell.direction}"
        word = "synergy" if cell.n_synergies == 1 else "synergies"
        return f"{cell.n_synergies} {word}, push along {cell.direction}"

    @property
    def about(self) -> str:
        """What it shows, and what the paper found, in words (Markdown)."""
        cell = self.cell
        shows = BY_RATIO[cell.weight_ratio] if cell.table == 2 else BY_SYNERGIES[cell.n_synergies]
        return (
            f"{shows} *Table {'I' * cell.table} of the paper, with its own synergies, which are not public: "
            f"F = {cell.force_norm:g} N, {cell.alignment_angle_deg:g}°. Links may pass through the object there.*"
        )

    def problem(self) -> GraspProblem:
        """Return the problem: the paper's cylinder, hand and parameters, without clearances."""
        return GraspProblem.paper(
            hand=load_hand(),
            grasp_object=Cylinder(),
            tasks=(parse_task(f"force:+{self.cell.direction}"),),
            n_synergies=self.cell.n_synergies,
            parameters=replace(GraspParameters(), force_weight=self.cell.weight_ratio, task_weight=1.0),
        )


def paper_presets() -> dict[str, Preset]:
    """Return the presets by title: 1, 2, 3 and 15 synergies for forces along y and x, and three weight ratios."""
    presets = [Preset(cell) for cell in PAPER_CELLS]
    return {preset.title: preset for preset in presets}
