"""Draw the rooms of the package in layers, with which uses which, and list them in CONTRIBUTING.

Rooms and their order are those of tests/architecture.py, the arrows are the imports in the source; an arrow that
follows from others is left out. Usage: ``python scripts/make_architecture.py [--check]``
"""

from __future__ import annotations

import argparse
import re
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.architecture import ROOMS, note_of, uses  # noqa: E402

PICTURE = ROOT / "docs" / "images" / "architecture.svg"
GUIDE = ROOT / "CONTRIBUTING.md"
BLOCK = re.compile(r"(?<=<!-- rooms -->\n).*(?=<!-- end of rooms -->)", re.DOTALL)
"""The list of rooms in CONTRIBUTING."""
FOUNDATIONS = ("exceptions", "values", "spatial", "checks", "files")
"""Rooms that most others use; their arrows would say nothing."""

WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 200, 62, 22, 40, 20
"""Sizes of boxes and gaps [px]."""
NOTE_LENGTH = 32
"""Letters in a line of a note."""


@dataclass(frozen=True)
class Box:
    """A room and where it is drawn [px]."""

    title: str
    note: str
    x: float
    y: float


def shown_uses() -> dict[str, set[str]]:
    """Return the rooms that each room uses, without foundations and what follows from others."""
    direct = {room: used - set(FOUNDATIONS) for room, used in uses().items() if room not in FOUNDATIONS}
    below: dict[str, set[str]] = {}
    for room in direct:  # from the lowest up
        below[room] = direct[room].union(*(below[other] for other in direct[room]))
    return {
        room: {other for other in found if not any(other in below[third] for third in found - {other})}
        for room, found in direct.items()
    }


def place(edges: dict[str, set[str]]) -> list[Box]:
    """Return the boxes: a row for each length of the longest chain of uses, the highest on top."""
    level: dict[str, int] = {}
    for title in edges:
        level[title] = 1 + max((level[other] for other in edges[title]), default=-1)
    rows: dict[int, list[str]] = {}
    for title in edges:
        rows.setdefault(level[title], []).append(title)
    top, widest = max(rows), max(map(len, rows.values()))
    boxes: dict[str, Box] = {}

    def wish(title: str) -> float:
        """Return the middle of the users of a group."""
        users = [box.x for box in boxes.values() if title in edges[box.title]]
        return sum(users) / max(len(users), 1)

    for row in sorted(rows, reverse=True):
        left = MARGIN + (widest - len(rows[row])) * (WIDTH + GAP_X) / 2
        y = MARGIN + (top - row) * (HEIGHT + GAP_Y)
        for k, title in enumerate(sorted(rows[row], key=wish)):
            boxes[title] = Box(title, note_of(title), left + k * (WIDTH + GAP_X), y)
    return list(boxes.values())


def picture() -> str:
    """Return the picture as SVG."""
    edges = shown_uses()
    boxes = {box.title: box for box in place(edges)}
    width = max(box.x for box in boxes.values()) + WIDTH + MARGIN
    height = max(box.y for box in boxes.values()) + HEIGHT + MARGIN
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" font-family="sans-serif">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z" fill="#5c677d"/></marker></defs>',
        f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
    ]
    for title, found in edges.items():
        lines += [_arrow(boxes[title], boxes[other]) for other in sorted(found)]
    for box in boxes.values():
        lines += _drawn(box)
    return "\n".join([*lines, "</svg>"]) + "\n"


def _arrow(user: Box, used: Box) -> str:
    """Return the arrow from a group down to one that it uses."""
    share = (used.x - user.x) / 2000
    x1, y1 = user.x + WIDTH * (0.5 + share), user.y + HEIGHT
    x2, y2 = used.x + WIDTH * (0.5 - share), used.y
    bend = (y2 - y1) / 2
    return (
        f'<path d="M{x1:.1f} {y1:.1f} C{x1:.1f} {y1 + bend:.1f} {x2:.1f} {y2 - bend:.1f} {x2:.1f} {y2:.1f}" '
        'fill="none" stroke="#5c677d" stroke-width="1.2" marker-end="url(#tip)"/>'
    )


def _drawn(box: Box) -> list[str]:
    """Return the elements of a box."""
    middle = box.x + WIDTH / 2
    notes = textwrap.wrap(box.note.split(":")[0].rstrip("."), NOTE_LENGTH)[:2]
    return [
        f'<rect x="{box.x:g}" y="{box.y:g}" width="{WIDTH}" height="{HEIGHT}" rx="8" fill="#eef1f6" stroke="#4361ee"/>',
        f'<text x="{middle:g}" y="{box.y + 21:g}" text-anchor="middle" font-size="15" font-weight="bold" '
        f'fill="#1b263b">{escape(box.title)}</text>',
        *(
            f'<text x="{middle:g}" y="{box.y + 37 + 14 * k:g}" text-anchor="middle" font-size="11" fill="#415a77">'
            f"{escape(line)}</text>"
            for k, line in enumerate(notes)
        ),
    ]


def listed() -> str:
    """Return the table of rooms, the lowest first."""
    rows = [f"| `{room}` | {escape(note_of(room))} |" for room in ROOMS]
    return "\n".join(["| room | what it holds |", "|---|---|", *rows]) + "\n"


def main() -> int:
    """Write picture and list, or compare them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="Only say whether they are current.")
    check = parser.parse_args().check
    table = listed()
    made = {PICTURE: picture(), GUIDE: BLOCK.sub(lambda _: table, GUIDE.read_text(encoding="utf-8"))}
    stale = [path for path, text in made.items() if not path.is_file() or path.read_text(encoding="utf-8") != text]
    for path in stale:
        if check:
            sys.stderr.write(f"{path.name} is out of date: run python scripts/make_architecture.py\n")
        else:
            path.write_text(made[path], encoding="utf-8")
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
