"""The figures of [Mavrogiannis2014] section IV as ready-made problems."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..hand import load_hand
from ..objects import Cylinder
from ..problem import GraspParameters, GraspProblem
from ..task import parse_task


@dataclass(frozen=True)
class Preset:
    """A problem with a name.

    Attributes:
        n_synergies: n_s.
        task: Task in its text form.
        force_weight: w_F, with w_C = 1: their ratio decides between low force and good transmission.
    """

    n_synergies: int
    task: str
    force_weight: float = 1e-6

    def problem(self) -> GraspProblem:
        """Return the problem: the paper's cylinder, hand and parameters."""
        return GraspProblem(
            hand=load_hand(),
            grasp_object=Cylinder(),
            tasks=(parse_task(self.task),),
            n_synergies=self.n_synergies,
            parameters=replace(GraspParameters(), force_weight=self.force_weight, task_weight=1.0),
        )


def paper_presets() -> dict[str, Preset]:
    """Return the presets by title: 1, 2, 3 and 15 synergies for forces along y and x, and three weight ratios."""
    presets = {
        f"{n_s} {'synergy' if n_s == 1 else 'synergies'}, push along {axis}": Preset(n_s, f"force:+{axis}")
        for axis in ("y", "x")
        for n_s in (1, 2, 3, 15)
    }
    for ratio in (1e-9, 1e-6, 1.0):
        presets[f"weights w_F/w_C = {ratio:g}, 3 synergies, y"] = Preset(3, "force:+y", ratio)
    return presets
