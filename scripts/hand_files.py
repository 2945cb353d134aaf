"""What the scripts that write hands with a description share: writing, and comparing with what is there."""

from __future__ import annotations

import argparse
from pathlib import Path


def write_or_check(name: str, summary: str, urdf: str, tables: tuple[str, ...], where: str) -> int:
    """Write the URDF, or with --check compare it and the tables of the description with what is there.

    Args:
        name: Name of the hand: of its folder in ``urdf/`` and of its files.
        summary: What the script does, for its help.
        urdf: The URDF.
        tables: Texts that the description has to hold.
        where: What these are called in the description.

    Returns:
        Exit code: 1 if a comparison found a difference.
    """
    parser = argparse.ArgumentParser(description=summary)
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file differs")
    parser.add_argument(
        "--output", type=Path, default=Path(__file__).parents[1] / "urdf" / name, help="folder of the files"
    )
    arguments = parser.parse_args()
    folder = arguments.output
    file, described = folder / f"{name}.urdf", folder / f"{name}.toml"
    if arguments.check:
        description = described.read_text(encoding="utf-8") if described.exists() else ""
        same = file.read_text(encoding="utf-8") == urdf
        return 0 if same and all(table in description for table in tables) else 1
    folder.mkdir(parents=True, exist_ok=True)
    file.write_text(urdf, encoding="utf-8")
    print(f"{where} of the description have to be:", *tables, sep="\n\n")
    return 0
