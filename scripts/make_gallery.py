#!/usr/bin/env python3
"""Plan default grasps of twelve objects with three hands, print their figures and write docs/gallery.md with pictures.

What an expert looks at: force against the least that was found, angle of the task and the best angle that any start
found, the finger that does least, joints on their stops, torques, and whether the hand closes from open. It takes about
ten minutes.
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
from grasp_planner.planning.trade import task_angle

DOCS = Path(__file__).resolve().parents[1] / "docs"
HANDS = {"dlr_hit_ii_right": "DLR/HIT II", "allegro_right": "Allegro", "tendon_hand": "three fingers, four tendons"}
"""Hands by name, with their titles; one that is driven by tendons is planned with all of them only."""
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
SAME_ANGLE_DEG = 5.0
"""An angle that another start found counts as better from here on [degrees]."""
MOST_FORCE, LEAST_SHARE, MOST_TORQUE = 1.6, 0.05, 0.5
"""What is asked of a grasp: F over the least, share of the least finger, share of a torque limit."""


@dataclass(frozen=True)
class Row:
    """The figures of one grasp.

    Attributes:
        hand: Title of the hand.
        name: Name of the object.
        n_synergies: n_s.
        grasp: The grasp.
        best: Of what the starts of its search ended at, the feasible grasp with the least angle.
        ratio: F over the least F that the search found.
        share: Smallest share of a finger in the sum of normal forces.
        stops: Number of joints within two degrees of a stop.
        torque: Largest share of a joint torque in its limit.
        closes: Whether the hand closes from open and then holds.
    """

    hand: str
    name: str
    n_synergies: int
    grasp: gp.Grasp
    best: gp.Grasp
    ratio: float
    share: float
    stops: int
    torque: float
    closes: bool

    @classmethod
    def of(cls, hand: str, name: str, grasp: gp.Grasp, found: Sequence[gp.Grasp]) -> Row:
        """Return the figures of a grasp, out of what its search found."""
        problem, q, normal = grasp.problem, grasp.joint_angles, grasp.normal_forces
        least = grasp.search.least_force if grasp.search is not None else None
        room = np.minimum(q - problem.hand.lower, problem.hand.upper - q)
        return cls(
            hand=hand,
            name=name,
            n_synergies=problem.n_synergies,
            grasp=grasp,
            best=min((grasp, *(each for each in found if each.feasible)), key=task_angle),
            ratio=grasp.force_norm / (least or grasp.force_norm),
            share=float(normal.min() / normal.sum()),
            stops=int((room < np.radians(NEAR_STOP_DEG)).sum()),
            torque=float((np.abs(grasp.joint_torques) / problem.torque_limits).max()),
            closes=grasp.feasible and grasp.closing.holds,
        )

    @property
    def serves(self) -> bool:
        """Whether no start found a better angle."""
        return task_angle(self.grasp) <= task_angle(self.best) + SAME_ANGLE_DEG

    @property
    def cells(self) -> tuple[str, ...]:
        """The row of the table."""
        if not self.grasp.feasible:
            return (self.name, str(self.n_synergies), "none found", *("",) * (len(HEAD) - 3))
        return (
            self.name,
            str(self.n_synergies),
            f"{self.grasp.force_norm:.2f}",
            f"{self.ratio:.2f}",
            f"{task_angle(self.grasp):.0f}",
            "" if self.serves else f"{task_angle(self.best):.0f}° at {self.best.force_norm:.1f} N",
            f"{100 * self.share:.0f}",
            str(self.stops),
            f"{100 * self.torque:.0f}",
            "yes" if self.closes else "no",
        )


HEAD = (
    *("object", "n_s", "F [N]", "F / least", "angle [°]", "a better angle"),
    *("least finger [%]", "on stops", "torque [%]", "closes"),
)


def planned(hand: str, name: str, n_synergies: int | None) -> Row:
    """Plan one grasp with the defaults."""
    problem = gp.GraspProblem(gp.load_hand(hand), gp.parse_object(OBJECTS[name]), n_synergies=n_synergies)
    found: list[gp.Grasp] = []
    return Row.of(HANDS[hand], name, gp.plan_grasp(problem, result_callback=found.append), found)


def summary(rows: Sequence[Row]) -> str:
    """Return in how many cases what is asked for is kept."""
    found = [row for row in rows if row.grasp.feasible]
    kept = {
        f"F ≤ {MOST_FORCE} × the least found": [row.ratio <= MOST_FORCE for row in found],
        f"no finger below {100 * LEAST_SHARE:.0f} % of the sum": [row.share >= LEAST_SHARE for row in found],
        f"no joint within {NEAR_STOP_DEG:g}° of a stop": [row.stops == 0 for row in found],
        f"no torque above {100 * MOST_TORQUE:.0f} % of its limit": [row.torque <= MOST_TORQUE for row in found],
        f"angle within {SAME_ANGLE_DEG:g}° of the best of the search": [row.serves for row in found],
        "closes from open": [row.closes for row in found],
    }
    if not found:
        return f"- feasible: 0 of {len(rows)}"
    lines = [f"- {what}: {sum(met)} of {len(met)}" for what, met in kept.items()]
    return "\n".join([f"- feasible: {len(found)} of {len(rows)}", *lines])


def page(rows: Sequence[Row], pictures: Sequence[tuple[str, str, str]]) -> str:
    """Return the page.

    Args:
        rows: The figures.
        pictures: Title of the hand, caption and address of each picture.
    """
    lines = [
        "# Gallery",
        "",
        "Default plans of twelve objects with three hands and a force along +y, made by",
        "`python scripts/make_gallery.py`. F / least: against the least force that any start of the search found;",
        "a better angle: the least of all starts and the force it takes, where it is more than five degrees better;",
        "least finger: its share of the sum of normal forces, by rounding below 5 % where it stands on the search's",
        "bound; on stops: joints within two degrees of one; torque:",
        "the largest share of a joint's limit. A joint stays on its stop where off it the task would lose",
        "more than five degrees, or C would more than double.",
        "",
        "All hands together:",
        "",
        summary(rows),
        "",
    ]
    for hand in dict.fromkeys(row.hand for row in rows):
        mine = [row for row in rows if row.hand == hand]
        cells = (HEAD, ("---",) * len(HEAD), *(row.cells for row in mine))
        table = ["| " + " | ".join(each) + " |" for each in cells]
        shown = [f"![{caption}]({address})" for title, caption, address in pictures if title == hand]
        lines += [f"## {hand}", "", *table, "", summary(mine), "", *(line for each in shown for line in (each, ""))]
    return "\n".join(lines)


def drawn(row: Row) -> Figure:
    """Return the picture of a grasp."""
    return draw_grasp(row.grasp, title=f"{row.name}, {row.n_synergies} synergies: F = {row.grasp.force_norm:.1f} N")


def numbers_of(hand: str, asked: str) -> list[int | None]:
    """Return the numbers of synergies that a hand is planned with."""
    if gp.load_hand(hand).tendons is not None:
        return [None]
    return [int(text) for text in asked.split(",")]


@click.command(help=__doc__)
@click.option("--hands", default=",".join(HANDS), show_default=True, help="Hands by name.")
@click.option("--objects", "count", type=click.IntRange(1, len(OBJECTS)), default=12, help="How many objects.")
@click.option("--synergies", default="1,2,3,8", show_default=True, help="Numbers of synergies; the last one is drawn.")
@click.option("--out", type=click.Path(path_type=Path), default=DOCS, show_default="docs", help="Folder of the page.")
def main(hands: str, count: int, synergies: str, out: Path) -> None:
    """Plan, print and write."""
    rows, pictures = [], []
    folder = out / "images" / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    click.echo("\t".join(("hand", *HEAD)))
    for hand in hands.split(","):
        for name in list(OBJECTS)[:count]:
            for n_synergies in numbers_of(hand, synergies):
                row = planned(hand, name, n_synergies)
                rows.append(row)
                click.echo("\t".join((hand, *row.cells)))
            if row.grasp.feasible:
                file = f"{hand}_{name.replace(' ', '_')}.png"
                drawn(row).savefig(folder / file, dpi=60)
                pictures.append((row.hand, f"{name}, {row.n_synergies} synergies", f"images/gallery/{file}"))
    (out / "gallery.md").write_text(page(rows, pictures), encoding="utf-8")
    click.echo(summary(rows))


if __name__ == "__main__":
    main()
