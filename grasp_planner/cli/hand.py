"""Commands for hands: ``hand check``."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from ..exceptions import GraspPlannerError
from ..hand.loading import checked_hand, locked_joints
from .output import write_or_print

FILE = click.Path(path_type=Path, dir_okay=False)


@click.group("hand")
def hand_group() -> None:
    """Bring your own hand."""


@hand_group.command("check")
@click.argument("urdf", type=FILE)
@click.option("--toml", "description", type=FILE, help="Write the proposed description to this file.")
@click.option("--png", "picture", type=FILE, help="Draw the hand with what was guessed into this file.")
@click.option("--lock", "locks", multiple=True, help="Fix a joint: NAME=VALUE in rad or m. Repeatable.")
@click.option("--force", is_flag=True, help="Overwrite files that exist.")
def check_command(
    urdf: Path, description: Path | None, picture: Path | None, locks: tuple[str, ...], force: bool
) -> None:
    """Find fingers, tips, couplings and limits of a URDF, propose a description and say what is missing.

    With --toml the contacts are those that planning uses: where the pads of a hand with one motor hold nothing, a short
    search moves them, and a line says so. Exit code 1 if the URDF can't be used as it is.
    """
    from ..drawing.hand_check_picture import save_hand_picture
    from ..hand.check import check_hand
    from ..hand.proposal import proposed_description, report_lines
    from ..planning.side_contacts import said_of, with_planned_contacts

    for path in (description, picture):
        if path is not None and path.exists() and not force:
            raise click.ClickException(f"{path} exists; --force overwrites it")
    try:
        check = check_hand(urdf, locked_joints(locks))
        for line in report_lines(check):
            click.echo(line)
        if not check.usable:
            sys.exit(1)
        planned = None
        if description is not None:
            loaded = checked_hand(check)
            hand = with_planned_contacts(loaded)
            planned = hand.description
            for line in said_of(loaded.hand, hand):
                click.echo(line)
        proposal = proposed_description(check, description.parent if description else None, planned)
        if picture is not None:
            save_hand_picture(check, picture)
    except GraspPlannerError as error:
        raise click.ClickException(str(error)) from None
    if description is None:
        click.echo("\n" + proposal, nl=False)
        return
    write_or_print(proposal, description)
