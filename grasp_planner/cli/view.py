"""The commands ``grasp-planner view`` and ``grasp-planner export``."""

from __future__ import annotations

import threading
import webbrowser
from pathlib import Path

import click

from ..exceptions import InvalidValueError
from .grasp_file import HAND, opened_grasp

DEFAULT_PORT = 8080
FILM_POSTURES = 14
"""Postures of a film before the closed hand."""

RESULT = click.Path(exists=False, dir_okay=False, path_type=Path)
RESULT_OR_RUN = click.Path(exists=False, path_type=Path)


@click.command("view")
@click.argument("result", type=RESULT_OR_RUN, required=False)
@HAND
@click.option("--row", type=click.IntRange(min=0), default=None, help="Row of a batch run, if RESULT is its folder.")
@click.option(
    "--filter", "where", metavar="CONDITION", default="", help="Rows of the run to go through: SQL over its columns."
)
@click.option("--port", type=click.IntRange(0, 65535), default=DEFAULT_PORT, show_default=True, help="0 for any free.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--allow-remote", is_flag=True, help="Allow an address that other machines can reach.")
@click.option("--token", is_flag=True, help="Ask for a token, part of the address, also on this machine.")
@click.option("--no-open", is_flag=True, help="Do not open the browser.")
def view(
    result: Path | None,
    hand: str | None,
    row: int | None,
    where: str,
    port: int,
    host: str,
    allow_remote: bool,
    token: bool,
    no_open: bool,
) -> None:
    """Open the interactive viewer in the browser.

    Shows the grasp of the file RESULT, or a good one to begin with. If RESULT is the folder of a batch run, its rows
    are gone through on the page, from row K with --row K, with --filter only those that meet a condition such as
    "feasible and n_synergies = 3"; the links of its report open rows here meanwhile.
    """
    from ..viewer import GraspViewer
    from ..viewer.server import LOOPBACK

    if result is None or not result.is_dir():
        for name, value in (("--row", row), ("--filter", where or None)):
            if value is not None:
                raise InvalidValueError(name, value, "only with the folder of a batch run as RESULT")
    if hand is not None and result is None:
        raise InvalidValueError("--hand", hand, "only with a RESULT")
    grasp, rows = None, None
    if result is not None and result.is_dir():
        from ..batch import RunRows

        rows = RunRows(result, where=where, row=row, hand=hand)
    elif result is not None:
        grasp = opened_grasp(result, hand)
    viewer = GraspViewer(grasp, host=host, port=port, allow_remote=allow_remote, token=token, rows=rows)
    try:
        if host not in LOOPBACK:
            click.echo(
                f"Warning: whoever has the address below and can reach {host} can see and steer this page.", err=True
            )
        click.echo(f"The viewer is at {viewer.url}; press Ctrl+C to end it.")
        if not no_open:
            webbrowser.open(viewer.url)
        threading.Event().wait()
    except KeyboardInterrupt:
        click.echo("")
    finally:
        viewer.stop()


@click.command("export")
@click.argument("result", type=RESULT)
@HAND
@click.option("--html", "html_path", type=RESULT, help="HTML file to write.")
@click.option("--gif", type=RESULT, help="Film of the closing hand to write.")
@click.option("--title", default=None, help="Heading of the page.")
def export(result: Path, hand: str | None, html_path: Path | None, gif: Path | None, title: str | None) -> None:
    """Write the grasp of the file RESULT as one web page that opens offline, or as a film of its closing."""
    if html_path is None and gif is None:
        raise click.UsageError("nothing to write: give --html FILE, --gif FILE or both")
    grasp = opened_grasp(result, hand)
    if html_path is not None:
        from ..viewer import export_html

        export_html(grasp, html_path, title)
        click.echo(f"wrote {html_path}")
    if gif is not None:
        from ..drawing.film import save_film
        from ..viewer.opening import approach

        save_film(grasp, approach(grasp, FILM_POSTURES), gif)
        click.echo(f"wrote {gif}")
