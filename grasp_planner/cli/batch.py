"""Commands for batches: ``batch``, ``report`` and ``export-rows``."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import click

from ..exceptions import GraspPlannerError, InvalidValueError
from ..files.text import read_text_file
from .grasp_file import HAND
from .output import say, say_findings

if TYPE_CHECKING:
    from ..batch import BatchProgress, CaseTable

SHOWN_CASES = 5
"""Cases that a dry run shows."""
LINE_EVERY_S = 10.0
"""How often a line is written where there is no terminal for a progress bar [s]."""
MAX_ROWS, MAX_DIGITS = 1_000_000, 9
"""Most rows of a list, most digits of a number in it."""
INTERRUPTED = 130
"""Exit code after Ctrl-C."""
FOLDER = click.Path(path_type=Path, file_okay=False)


class _OneLine(click.ClickException):
    """An error of this package, shown as one line."""

    exit_code = 2

    def show(self, file: IO[Any] | None = None) -> None:
        """Print it on standard error."""
        say("error", self.message)


@contextmanager
def _plain_errors() -> Iterator[None]:
    """Turn errors of this package into one line."""
    try:
        yield
    except GraspPlannerError as error:
        raise _OneLine(str(error)) from None


@click.command("batch")
@click.argument("spec", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--out", type=FOLDER, help="Folder of the run; run again with the same folder to go on.")
@click.option("--workers", type=click.IntRange(min=1), help="Worker processes; as many as there are cores if left out.")
@click.option("--scheduler", metavar="ADDRESS", help="Use the workers of a Dask scheduler, such as tcp://host:8786.")
@click.option("--dry-run", is_flag=True, help="Check the specification, print the number of cases and the first ones.")
@click.option("--planner", metavar="MODULE:FUNCTION", help="Plan with another function, called like plan_grasp.")
def batch_command(
    spec: Path, out: Path | None, workers: int | None, scheduler: str | None, dry_run: bool, planner: str | None
) -> None:
    """Plan all cases of the specification SPEC (YAML), one row each, into Parquet files.

    Ctrl-C stops with everything finished so far on disk; a second one stops at once.
    """
    with _plain_errors():
        from ..batch import CaseTable, read_spec, run_batch
        from ..batch.planning_job import STANDARD_PLANNER
        from ..batch.yaml_file import MAX_SPEC_BYTES

        parsed = read_spec(spec)
        if dry_run:
            _show_cases(CaseTable(parsed))
            return
        if out is None:
            raise click.UsageError("Missing option '--out' (or ask for a --dry-run).")
        with progress("planning") as on_progress:
            summary = run_batch(
                parsed,
                out,
                workers=workers,
                scheduler=scheduler,
                planner=planner or STANDARD_PLANNER,
                spec_text=read_text_file(spec, MAX_SPEC_BYTES),
                on_progress=on_progress,
                on_hand=say_findings,
            )
    new = summary.done - summary.resumed
    click.echo(
        f"{summary.done} of {summary.total} cases done ({new} now, {summary.elapsed_s:.1f} s), "
        f"{summary.feasible} feasible: {out / 'results'}"
    )
    if summary.interrupted:
        click.echo("stopped; run the same command again to go on", err=True)
        # Everything is on disk and every worker has ended; taking the interpreter apart would only take time.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(INTERRUPTED)


@click.command("report")
@click.argument("run", type=FOLDER)
@click.option("--output", type=click.Path(path_type=Path, dir_okay=False), help="HTML file; report.html in the run.")
@click.option("--pictures", type=click.IntRange(min=0), default=6, show_default=True, help="How many grasps to draw.")
@HAND
def report_command(run: Path, output: Path | None, pictures: int, hand: str | None) -> None:
    """Write one HTML file about the run in the folder RUN; it needs no network."""
    with _plain_errors():
        from ..batch.report import write_report

        click.echo(write_report(run, output, pictures=pictures, hand=hand))


@click.command("export-rows")
@click.argument("run", type=FOLDER)
@click.option(
    "--format", "form", type=click.Choice(["json", "csv", "dexgraspbench"]), default="json", show_default=True
)
@click.option("--out", type=FOLDER, required=True, help="Folder for the files.")
@click.option("--rows", metavar="LIST", default="", help="Rows, such as 0,4,10-19.")
@click.option("--where", metavar="CONDITION", default="", help="SQL over the columns; 'feasible' if left out.")
@click.option("--all-joints", is_flag=True, help="dexgraspbench: every URDF joint, not the independent ones only.")
def export_command(run: Path, form: str, out: Path, rows: str, where: str, all_joints: bool) -> None:
    """Export rows of the run in the folder RUN: grasp JSON, CSV of joint angles, or the DexGraspBench layout."""
    with _plain_errors():
        from ..batch import find_rows
        from ..batch.export import export_rows

        chosen = parse_rows(rows) if rows else None
        if chosen is None or where:
            found = find_rows(run, where or "feasible")
            chosen = found if chosen is None else [row for row in found if row in set(chosen)]
        files = export_rows(run, chosen, out, form, all_joints=all_joints)
        click.echo(f"{len(chosen)} rows in {len(files)} files: {out}")


def parse_rows(text: str) -> list[int]:
    """Return the rows of a list such as ``0,4,10-19``.

    Raises:
        InvalidValueError: If it is malformed.
    """
    rows: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        ends = [first, last if dash else first]
        if not all(end.isascii() and end.isdecimal() and len(end) <= MAX_DIGITS for end in ends):
            raise InvalidValueError("rows", part, "numbers and ranges, such as 0,4,10-19")
        span = range(int(ends[0]), int(ends[1]) + 1)
        if len(rows) + len(span) > MAX_ROWS:
            raise InvalidValueError("rows", part, f"at most {MAX_ROWS} rows at once")
        rows += span
    return rows


def _show_cases(table: CaseTable) -> None:
    """Print the number of cases and the first ones."""
    table.check(say_findings)
    click.echo(f"{len(table)} cases")
    for row, case in enumerate(table[:SHOWN_CASES]):
        settings = " ".join(f"{name}={value}" for name, value in case.settings.items())
        click.echo(
            f"  {row}: {case.hand} {case.object} {' + '.join(case.task)} n_synergies={case.n_synergies} "
            f"seed={case.seed} time_limit_s={case.time_limit_s:g} {settings}".rstrip()
        )
    if len(table) > SHOWN_CASES:
        click.echo(f"  … and {len(table) - SHOWN_CASES} more")


def progress_text(state: BatchProgress) -> str:
    """Return rate, success share and time left in words."""
    rate = "–" if state.rate is None else f"{state.rate:.2f} cases/s"
    share = "–" if state.success is None else f"{100 * state.success:.0f} % feasible"
    left = "–" if state.seconds_left is None else f"{_clock(state.seconds_left)} left"
    return f"{rate} · {share} · {left}"


def _clock(seconds: float) -> str:
    """Return a time as h:mm:ss."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


@contextmanager
def progress(title: str) -> Iterator[Callable[[BatchProgress], None]]:
    """Show a progress bar on a terminal; elsewhere a line now and then."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _line_writer()
        return
    columns = (TextColumn(title), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[words]}"))
    with Progress(*columns, console=console, refresh_per_second=4) as bar:
        task = bar.add_task(title, total=None, words="")

        def show(state: BatchProgress) -> None:
            bar.update(task, total=state.total, completed=state.done, words=progress_text(state))

        yield show


def _line_writer() -> Callable[[BatchProgress], None]:
    """Return what writes a line now and then."""
    last = [time.monotonic()]

    def show(state: BatchProgress) -> None:
        if time.monotonic() - last[0] >= LINE_EVERY_S:
            last[0] = time.monotonic()
            click.echo(f"{state.done}/{state.total} · {progress_text(state)}", err=True)

    return show
