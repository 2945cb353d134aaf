#!/usr/bin/env python3
"""Plan default grasps of twelve objects, print their figures and write the page docs/gallery.md with pictures.

What an expert looks at: force against the least that was found, angle of the task, the finger that does least, joints
on their stops, torques, and whether the hand closes from open. It takes a few minutes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from matplotlib.figure import Figure

import grasp_planner as gp
from grasp_planner.drawing.picture import draw_grasp

DOCS = Path(__file__).resolve().parents[1] / "docs"
HAND = "dlr_hit_ii_right"
OBJECTS = {
    "cylinder": "cylinder:radius=0.03,height=0.12",
    "thin cylinder": "cylinder:radius=0.025,height=0.15",
    "wide cylinder": "cylinder:radius=0.038,height=0.1",
    "ball": "sphere:radius=0.035",
    "small ball": "sphere:radius=0.03",
    "box": "box:x=0.06,y=0.06,z=0.12",
    "flat box": "box:x=0.04,y=0.07,z=0.12",
    "slim box": "box:x=0.05,y=0.05,z=0.15",
    "capsule": "capsule:radius=0.03,height=0.08",
    "thin capsule": "capsule:radius=0.025,height=0.1",
    "egg": "ellipsoid:x=0.03,y=0.03,z=0.05",
    "lens": "ellipsoid:x=0.03,y=0.04,z=0.06",
}
NEAR_STOP_DEG = 2.0
"""Distance to a stop below which a joint stands on it [degrees]."""
MOST_FORCE, LEAST_SHARE, MOST_TORQUE = 1.6, 0.05, 0.5
"""What is asked of a grasp: F over the least, share of the least finger, share of a torque limit."""


@dataclass(frozen=True)
class Row:
    """The figures of one grasp.

    Attributes:
        name: Name of the object.
        n_synergies: n_s.
        grasp: The grasp.
        ratio: F over the least F that the search found.
        share: Smallest share of a finger in the sum of normal forces.
        stops: Number of joints within two degrees of a stop.
        torque: Largest share of a joint torque in its limit.
        closes: Whether the hand closes from open and then holds.
    """

    name: str
    n_synergies: int
    grasp: gp.Grasp
    ratio: float
    share: float
    stops: int
    torque: float
    closes: bool

    @classmethod
    def of(cls, name: str, grasp: gp.Grasp) -> Row:
        """Return the figures of a grasp."""
        problem, q, normal = grasp.problem, grasp.joint_angles, grasp.normal_forces
        least = grasp.search.least_force if grasp.search is not None else None
        room = np.minimum(q - problem.hand.lower, problem.hand.upper - q)
        return cls(
            name=name,
            n_synergies=problem.n_synergies,
            grasp=grasp,
            ratio=grasp.force_norm / (least or grasp.force_norm),
            share=float(normal.min() / normal.sum()),
            stops=int((room < np.radians(NEAR_STOP_DEG)).sum()),
            torque=float((np.abs(grasp.joint_torques) / problem.torque_limits).max()),
            closes=grasp.feasible and grasp.closing.holds,
        )

    @property
    def cells(self) -> tuple[str, ...]:
        """The row of the table."""
        if not self.grasp.feasible:
            return (self.name, str(self.n_synergies), "none found", *("",) * 6)
        return (
            self.name,
            str(self.n_synergies),
            f"{self.grasp.force_norm:.2f}",
            f"{self.ratio:.2f}",
            f"{self.grasp.alignments[0][0]:.0f}",
            f"{100 * self.share:.0f}",
            str(self.stops),
            f"{100 * self.torque:.0f}",
            "yes" if self.closes else "no",
        )


HEAD = ("object", "n_s", "F [N]", "F / least", "angle [°]", "least finger [%]", "on stops", "torque [%]", "closes")


def planned(name: str, n_synergies: int) -> Row:
    """Plan one grasp with the defaults."""
    problem = gp.GraspProblem(gp.load_hand(HAND), gp.parse_object(OBJECTS[name]), n_synergies=n_synergies)
    return Row.of(name, gp.plan_grasp(problem))


def summary(rows: Sequence[Row]) -> str:
    """Return in how many cases what is asked for is kept."""
    found = [row for row in rows if row.grasp.feasible]
    kept = {
        f"F ≤ {MOST_FORCE} × the least found": [row.ratio <= MOST_FORCE for row in found],
        f"no finger below {100 * LEAST_SHARE:.0f} % of the sum": [row.share >= LEAST_SHARE for row in found],
        f"no joint within {NEAR_STOP_DEG:g}° of a stop": [row.stops == 0 for row in found],
        f"no torque above {100 * MOST_TORQUE:.0f} % of its limit": [row.torque <= MOST_TORQUE for row in found],
        "closes from open": [row.closes for row in found],
    }
    lines = [f"- {what}: {sum(met)} of {len(met)}" for what, met in kept.items()]
    return "\n".join([f"- feasible: {len(found)} of {len(rows)}", *lines])


def page(rows: Sequence[Row], pictures: Sequence[tuple[str, str]]) -> str:
    """Return the page.

    Args:
        rows: The figures.
        pictures: Caption and address of each picture.
    """
    table = ["| " + " | ".join(cells) + " |" for cells in (HEAD, ("---",) * len(HEAD), *(row.cells for row in rows))]
    drawn = [f"![{caption}]({address})" for caption, address in pictures]
    return "\n".join(
        [
            "# Gallery",
            "",
            "Default plans of twelve objects with the DLR/HIT II hand and a force along +y, made by",
            "`python scripts/make_gallery.py`. F / least: against the least force that any start of the search found;",
            "least finger: its share of the sum of normal forces; on stops: joints within two degrees of one; torque:",
            "the largest share of a joint's limit. A joint stays on its stop where off it the task would lose",
            "more than five degrees, or C would more than double.",
            "",
            *table,
            "",
            summary(rows),
            "",
            *(line for picture in drawn for line in (picture, "")),
        ]
    )


def drawn(row: Row) -> Figure:
    """Return the picture of a grasp."""
    return draw_grasp(row.grasp, title=f"{row.name}, {row.n_synergies} synergies: F = {row.grasp.force_norm:.1f} N")


@click.command(help=__doc__)
@click.option("--objects", "count", type=click.IntRange(1, len(OBJECTS)), default=12, help="How many objects.")
@click.option("--synergies", default="3,8", show_default=True, help="Numbers of synergies; the last one is drawn.")
@click.option("--out", type=click.Path(path_type=Path), default=DOCS, show_default="docs", help="Folder of the page.")
def main(count: int, synergies: str, out: Path) -> None:
    """Plan, print and write."""
    numbers, rows, pictures = [int(text) for text in synergies.split(",")], [], []
    folder = out / "images" / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    click.echo("\t".join(HEAD))
    for name in list(OBJECTS)[:count]:
        for n_synergies in numbers:
            row = planned(name, n_synergies)
            rows.append(row)
            click.echo("\t".join(row.cells))
        if row.grasp.feasible:
            file = f"{name.replace(' ', '_')}.png"
            drawn(row).savefig(folder / file, dpi=60)
            pictures.append((f"{name}, {n_synergies} synergies", f"images/gallery/{file}"))
    (out / "gallery.md").write_text(page(rows, pictures), encoding="utf-8")
    click.echo(summary(rows))


if __name__ == "__main__":
    main()
