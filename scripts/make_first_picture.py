"""Make the picture of README and guide: the grasp that the page opens with, and the film of its closing.

Usage: ``python scripts/make_first_picture.py [FOLDER]`` (docs/images if left out). Needs no display.
"""

from __future__ import annotations

import sys
from pathlib import Path

from grasp_planner.drawing.film import save_film
from grasp_planner.drawing.picture import save_picture
from grasp_planner.viewer import first_grasp
from grasp_planner.viewer.opening import approach

FRAMES = 14
"""Postures of the film."""


def save_first_picture(folder: Path) -> Path:
    """Make the picture in a folder; return the file."""
    path = folder / "first_grasp.png"
    save_picture(first_grasp(), path)
    return path


def main() -> None:
    """Make both."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images")
    save_first_picture(folder)
    grasp = first_grasp()
    save_film(grasp, approach(grasp, FRAMES), folder / "closing.gif")


if __name__ == "__main__":
    main()
