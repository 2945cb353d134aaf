"""``grasp-planner synergies``: list the synergy sets of a hand, look at one, fit one from joint angles, design one."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import Progress as ProgressBar
from rich.progress import track
from rich.table import Table

from ..exceptions import FileFormatError, InvalidValueError, NameNotFoundError, shown
from ..files.text import finite_number, read_text_file
from ..hand.loading import load_hand
from ..objects import parse_object
from ..planning.preparation import FEW_SYNERGIES
from ..problem.problem import GraspProblem
from ..synergies.space import SynergySpace, save_synergies, synergies_from_postures
from .grasp_file import hand_option
from .options import parse_counts

if TYPE_CHECKING:
    from ..synergy_design.design import Progress

MAX_POSTURE_BYTES = 50_000_000
"""Largest file of postures that is read."""

HAND = hand_option("Hand by name, or a description file (TOML) or a URDF.", "dlr_hit_ii_right")
FILE = click.Path(path_type=Path, dir_okay=False)


@click.group("synergies")
def synergies_group() -> None:
    """Look at synergy sets and fit your own."""


@synergies_group.command("list")
@HAND
def list_command(hand: str) -> None:
    """List the synergy sets of a hand, with where they come from."""
    loaded, console = load_hand(hand), Console()
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for column in ("set", "variance of 1, 2, 3, 5 synergies", "provenance"):
        table.add_column(column)
    files = loaded.description.synergies
    for name in loaded.synergy_set_names:
        space = loaded.synergies(name)
        marks = [mark for mark, of in (("default", files.default), ("clear", files.with_clearance)) if of == name]
        label = f"{name} ({', '.join(marks)})" if marks else name
        table.add_row(label, _shares(space), space.provenance)
    console.print(table)


@synergies_group.command("show")
@click.argument("name")
@HAND
@click.option("--count", type=int, default=3, show_default=True, help="How many synergies to show.")
@click.option("--picture", type=FILE, default=None, help="Draw the hand along each synergy into this PNG.")
def show_command(name: str, hand: str, count: int, picture: Path | None) -> None:
    """Show a synergy set: NAME of a set of the hand, or a file."""
    loaded, console = load_hand(hand), Console()
    space = loaded.synergies(name)
    shown = space.truncated(count)
    table = Table(title=f"{space.name}: q̄ and synergies", box=SIMPLE_HEAD, pad_edge=False, title_justify="left")
    table.add_column("joint")
    for column in ("q̄ [°]", *(f"s{k + 1}" for k in range(count))):
        table.add_column(column, justify="right")
    for joint, mean, row in zip(shown.joint_names, shown.mean, shown.basis, strict=True):
        table.add_row(joint, f"{np.degrees(mean):.1f}", *(f"{value:+.3f}" for value in row))
    console.print(table)
    console.print(f"cumulative variance of 1, 2, 3, 5: {_shares(space)}")
    console.print(space.provenance, style="dim", highlight=False)
    if picture is not None:
        from ..drawing.picture import save_synergy_strip

        save_synergy_strip(loaded, shown, picture)
        console.print(f"picture: {picture}")


@synergies_group.command("compare")
@HAND
@click.option(
    "--object", "object_text", default="cylinder", show_default=True, help="What to close around; see plan --object."
)
@click.option("--counts", default="1,2,3", show_default=True, help="Numbers of synergies, up to 4.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the starts.")
def compare_command(hand: str, object_text: str, counts: str, seed: int) -> None:
    """Compare how well the synergy sets of a hand close: as a rigid hand, before compliance helps.

    For each set and number of synergies: the largest gap between a contact and the object, and the least share
    (mu f_n - |f_t|)/|f| of a contact force, negative outside its friction cone, at the best of forty fits.
    """
    from ..synergy_design.closing_fit import closing_fit

    loaded, console = load_hand(hand), Console()
    numbers = parse_counts("counts", counts)
    if not numbers or max(numbers) > FEW_SYNERGIES:
        raise InvalidValueError("counts", counts, f"numbers from 1 to {FEW_SYNERGIES}")
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("set", no_wrap=True)
    table.add_column("n_s", justify="right")
    for column in ("variance", "gap \\[mm]", "cone"):
        table.add_column(column, justify="right")
    thing = parse_object(object_text)
    for name in track(loaded.synergy_set_names, "fitting", console=console, transient=True):
        space = loaded.synergies(name)
        for n_s in (number for number in numbers if number <= space.n_synergies):
            fit = closing_fit(GraspProblem.paper(loaded, thing, n_synergies=n_s, synergy_set=name), seed)
            table.add_row(name, str(n_s), _share(space, n_s), f"{1e3 * fit.gap:.2f}", f"{fit.cone_share:+.2f}")
    console.print(table)


@synergies_group.command("fit")
@click.argument("postures", type=FILE)
@HAND
@click.option("--out", type=FILE, required=True, help="File of the new set (CSV).")
@click.option("--name", default="fitted", show_default=True, help="Name of the new set.")
@click.option("--degrees", is_flag=True, help="The angles are in degrees.")
def fit_command(postures: Path, hand: str, out: Path, name: str, degrees: bool) -> None:
    """Fit a set by principal components from a CSV of joint angles: a header of joint names, a posture a row."""
    loaded, console = load_hand(hand), Console()
    names, angles = read_postures(postures)
    for joint in loaded.joint_names:
        if joint not in names:
            raise NameNotFoundError(f"joint in {postures}", joint, names)
    columns = [names.index(joint) for joint in loaded.joint_names]
    rows = angles[:, columns] * (np.pi / 180.0 if degrees else 1.0)
    provenance = f"PCA over the {len(rows)} postures of {postures.name}"
    space = synergies_from_postures(loaded.joint_names, rows, name=name, provenance=provenance)
    save_synergies(space, out)
    console.print(f"{len(rows)} postures; cumulative variance of 1, 2, 3, 5: {_shares(space)}; wrote {out}")


@synergies_group.command("design")
@HAND
@click.option("--motors", type=int, required=True, help="Number of motors: columns of the set.")
@click.option("--out", type=FILE, required=True, help="File of the new set (CSV).")
@click.option("--name", default=None, help="Name of the new set [default: motors_N].")
@click.option("--objects", type=int, default=42, show_default=True, help="Random objects it is made from.")
@click.option("--seed", type=int, default=20000, show_default=True, help="Seed of the first of them.")
@click.option("--scale", type=float, default=None, help="Factor on their sizes [default: by the width of the hand].")
@click.option("--contact-set", default=None, help="Contact set [default: the hand's].")
@click.option(
    "--patience",
    type=click.IntRange(1, 1000),
    default=6,
    show_default=True,
    help="Starts after which an object that none of them grasps is given up.",
)
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Worker processes.")
def design_command(
    hand: str,
    motors: int,
    out: Path,
    name: str | None,
    objects: int,
    seed: int,
    scale: float | None,
    contact_set: str | None,
    patience: int,
    workers: int,
) -> None:
    """Make a set for exactly so many motors from grasps of random objects that this planner finds.

    The grasps are moved, with links clear and a push held from every side, until the motors reach all of them.
    """
    from ..synergy_design.design import synergies_for_motors
    from ..synergy_design.training import Training, object_scale

    console = Console(stderr=True)
    scale = round(object_scale(load_hand(hand), contact_set), 3) if scale is None else scale
    with TemporaryDirectory(prefix="grasp_planner_") as folder, _design_report(console) as report:
        training = Training(hand, Path(folder), contact_set, scale=scale, patience=patience)
        space, grasped = synergies_for_motors(
            training, motors, objects=objects, first_seed=seed, workers=workers, report=report
        )
    count = f"{motors} motor{'s' if motors > 1 else ''}"
    given = f" --contact-set {contact_set}" if contact_set is not None else ""
    command = f"grasp-planner synergies design --hand {hand} --motors {motors} --objects {objects} --seed {seed}"
    provenance = "\n".join(
        [
            f"made for {count} from grasps that this package planned of random objects, moved within their "
            f"constraints towards what {count} can reach; not human data",
            f"{grasped} of the {objects} objects are grasped with it; links clear, standard load cases",
            f"{command} --patience {patience} --scale {scale:g}{given}",
        ]
    )
    save_synergies(replace(space, name=name or f"motors_{motors}", provenance=provenance), out)
    click.echo(f"{grasped} of {objects} objects are grasped with {count}; wrote {out}")


@contextmanager
def _design_report(console: Console) -> Iterator[Callable[[Progress | str], None]]:
    """Show how far a design is: a bar on a terminal, a line at the end of every stage everywhere."""
    with ProgressBar(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None)

        def show(what: Progress | str) -> None:
            if isinstance(what, str):
                console.print(what, highlight=False, markup=False)
            else:
                bar.update(task, description=what.stage, completed=what.done, total=what.total)

        yield show


def read_postures(path: Path) -> tuple[list[str], np.ndarray]:
    """Read a CSV of joint angles.

    Args:
        path: File with a header of joint names and a posture in every row.

    Returns:
        Joint names, and angles of shape (N, number of columns) in the file's unit.

    Raises:
        FileFormatError: If it can't be read or a number is malformed; names row and column.
    """
    lines = read_text_file(path, MAX_POSTURE_BYTES).splitlines()
    table = [row for row in csv.reader(lines) if row and not row[0].startswith("#")]
    if len(table) < 3:
        raise FileFormatError(path, "needs a header of joint names and at least two postures")
    header = [name.strip() for name in table[0]]
    values = []
    for number, row in enumerate(table[1:], start=2):
        if len(row) != len(header):
            raise FileFormatError(path, f"row {number}: {len(row)} columns instead of {len(header)}")
        values.append(
            [
                finite_number(path, f"row {number}, column {shown(name)}", text)
                for name, text in zip(header, row, strict=True)
            ]
        )
    return header, np.array(values)


def _share(space: SynergySpace, n_synergies: int) -> str:
    """Return the cumulative variance of the first synergies."""
    try:
        return f"{100 * space.explained_variance()[n_synergies - 1]:.0f} %"
    except InvalidValueError:
        return "not known"


def _shares(space: SynergySpace) -> str:
    """Return the cumulative variances of the first 1, 2, 3 and 5 synergies."""
    counts = (n for n in (1, 2, 3, 5) if n <= space.n_synergies)
    return " ".join(dict.fromkeys(_share(space, n) for n in counts))
