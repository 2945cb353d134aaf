"""The command line: ``grasp-planner plan`` and its sisters. Reads arguments and prints; plans nothing itself."""

from __future__ import annotations

import importlib
import re
import sys
import traceback
import warnings
from collections.abc import Callable
from typing import Any

import click

from .. import __version__
from ..exceptions import MAX_MESSAGE, MAX_VALUE, GraspPlannerError, cut
from .crash import say_unforeseen
from .output import say

EXIT_USAGE = 2
EXIT_UNFORESEEN = 70
"""Exit code of an error that nobody foresaw (EX_SOFTWARE of sysexits.h)."""
COMMANDS = {
    "plan": (".plan", "plan", "Plan a task-specific force-closure grasp."),
    "analyse": (
        ".analyse",
        "analyse",
        "Print margins, measures, stability, tolerance and sensitivities of a planned grasp.",
    ),
    "improve": (
        ".analyse",
        "improve",
        "Plan anew from a grasp, within a budget of grasping force, so that it withstands more.",
    ),
    "view": (".view", "view", "Open the interactive viewer in the browser."),
    "export": (
        ".view",
        "export",
        "Write the grasp of the file RESULT as one web page that opens offline, or as a film of its closing.",
    ),
    "reproduce": (
        ".reproduce",
        "reproduce",
        "Plan tables I and II of [Mavrogiannis2014] and print paper and ours, cell by cell.",
    ),
    "bench": (
        ".bench",
        "bench",
        "Benchmark the planner: speed of an evaluation, and seeded random problems, each planned with one call.",
    ),
    "simulate": (
        ".simulate",
        "simulate",
        "Test the grasp of the file RESULT in MuJoCo: its own springs and synergies move the hand, nothing else.",
    ),
    "study-synergies": (
        ".study",
        "study_synergies",
        "Plan random problems, simulate the grasps, and write a page: what holds, and which static margin predicts it.",
    ),
    "batch": (
        ".batch",
        "batch_command",
        "Plan all cases of the specification SPEC (YAML), one row each, into Parquet files.",
    ),
    "report": (".batch", "report_command", "Write one HTML file about the run in the folder RUN; it needs no network."),
    "export-rows": (
        ".batch",
        "export_command",
        "Export rows of the run in the folder RUN: grasp JSON, CSV of joint angles, or the DexGraspBench layout.",
    ),
    "hand": (".hand", "hand_group", "Bring your own hand."),
    "synergies": (".synergies", "synergies_group", "Look at synergy sets and fit your own."),
}
"""Every command: module and name it is found under, and the short help of the list; a test compares the last."""


class _Commands(click.Group):
    """A group that imports a command when it is called.

    It turns typed errors into one line and exit code 2, everything else that is raised into one line and exit code 70
    with a report, and warnings into one line each.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands; see the base class."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command, imported now; see the base class."""
        if cmd_name not in COMMANDS:
            return None
        module, name, _ = COMMANDS[cmd_name]
        found: click.Command = getattr(importlib.import_module(module, __package__), name)
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing one; see the base class."""
        width = formatter.width - 6 - max(map(len, COMMANDS))
        texts = {name: click.Command(name, help=text) for name, (*_, text) in COMMANDS.items()}
        with formatter.section("Commands"):
            formatter.write_dl([(name, text.get_short_help_str(width)) for name, text in texts.items()])

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; see the base class."""
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _warning_printer()
                return super().invoke(ctx)
        except BrokenPipeError:
            sys.stderr.close()
            sys.exit(1)
        except click.ClickException as error:
            said = _shortened(error.format_message())
            vars(error)["format_message"] = lambda: said
            raise
        except (click.exceptions.Exit, KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:  # the last guard: whatever comes here is one line, a panic of Rust code too
            if ctx.params.get("debug"):
                traceback.print_exc()
            if isinstance(error, GraspPlannerError):
                say("error", str(error))
                sys.exit(EXIT_USAGE)
            say_unforeseen(error, ctx.invoked_subcommand or "the command line")
            sys.exit(EXIT_UNFORESEEN)


def _shortened(message: str) -> str:
    """Return a message of click with what was typed cut, and then the whole."""
    typed = re.compile(rf"""'[^']{{{MAX_VALUE - 1},}}'|"[^"]{{{MAX_VALUE - 1},}}"|\S{{{MAX_VALUE + 1},}}""")
    return cut(typed.sub(lambda found: cut(found[0], MAX_VALUE), message), MAX_MESSAGE)


def _warning_printer() -> Callable[..., None]:
    """Return a function that prints each warning once, as one line on standard error."""
    shown: set[str] = set()

    def show(message: Warning | str, *_: object) -> None:
        line = " ".join(str(message).split())
        if line not in shown:
            say("warning", line)
        shown.add(line)

    return show


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="grasp-planner")
@click.option("--debug", is_flag=True, help="Show the traceback of an error too.")
def main(debug: bool) -> None:
    """Plan and understand task-specific grasps of synergy-driven robot hands."""
