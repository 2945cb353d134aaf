"""The command line: ``grasp-planner plan`` and its sisters. Reads arguments and prints; plans nothing itself."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from typing import Any, NoReturn

import click

from .. import __version__
from ..exceptions import GraspPlannerError
from .analyse import analyse, improve
from .batch import batch_command, export_command, report_command
from .bench import bench
from .hand import hand_group
from .plan import plan
from .reproduce import reproduce
from .simulate import simulate
from .study import study_synergies
from .synergies import synergies_group
from .view import export, view

EXIT_USAGE = 2


class _Commands(click.Group):
    """A group that turns typed errors into one line and exit code 2, and warnings into one line each."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; see the base class."""
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _warning_printer()
                return super().invoke(ctx)
        except GraspPlannerError as error:
            _fail(str(error))
        except BrokenPipeError:
            sys.stderr.close()
            sys.exit(1)


def _fail(message: str) -> NoReturn:
    """Print one line on standard error and exit."""
    click.echo(f"grasp-planner: error: {' '.join(message.split())}", err=True)
    sys.exit(EXIT_USAGE)


def _warning_printer() -> Callable[..., None]:
    """Return a function that prints each warning once, as one line on standard error."""
    shown: set[str] = set()

    def show(message: Warning | str, *_: object) -> None:
        line = " ".join(str(message).split())
        if line not in shown:
            click.echo(f"grasp-planner: warning: {line}", err=True)
        shown.add(line)

    return show


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="grasp-planner")
def main() -> None:
    """Plan and understand task-specific grasps of synergy-driven robot hands."""


for command in (
    plan,
    analyse,
    improve,
    view,
    export,
    reproduce,
    bench,
    simulate,
    study_synergies,
    batch_command,
    report_command,
    export_command,
    hand_group,
    synergies_group,
):
    main.add_command(command)
