"""Draw the architecture of the package: groups of modules in layers, and which group uses which.

The order of the modules is LAYERS of tests/test_architecture.py, the arrows are the imports in the source; an arrow
that follows from others is left out. Usage: ``python scripts/make_architecture_picture.py [--check]``
"""

from __future__ import annotations

import argparse
import ast
import sys
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.test_architecture import LAYERS, PACKAGE  # noqa: E402

OUTPUT = ROOT / "docs" / "images" / "architecture.svg"
GROUPS = (
    ("exceptions", "foundations", "errors, vectors, checked numbers"),
    ("synergies", "hand", "URDF, kinematics, synergies"),
    ("objects", "objects", "signed distances, masses, meshes"),
    ("contacts", "model", "the paper, one formula a function"),
    ("clearance_options", "problem", "hand + object + task + parameters"),
    ("variables", "state", "the model fused, with derivatives"),
    ("terms", "terms", "costs and constraints"),
    ("nlp", "solvers", "SLSQP, least squares, scaled program"),
    ("phase_one", "search", "feasibility, starts"),
    ("clearance_check", "grasp", "recomputes everything by the model"),
    ("planner", "planner", "many starts, the best grasp"),
    ("retreat", "judgement", "retreat check, why not"),
    ("record_layout", "record", "the JSON contract"),
    ("meshes", "pictures", "meshes and Matplotlib"),
    ("fingertips", "hand check", "proposal for a plain URDF"),
    ("paper_tables", "measurements", "the paper's tables, benchmarks"),
    ("batch", "batch", "many cases, Parquet, reports"),
    ("viewer", "viewer", "the browser"),
    ("cli_options", "command line", "arguments and printing only"),
)
"""First module of each group in LAYERS, its title, and what it holds."""

APART = {"coal_distances": "distances", "distances": "distances"}
"""Modules within the range of one group that make another one, used from several."""
NOTES = {title: note for _, title, note in GROUPS} | {"distances": "between bodies: exact, and smooth"}

WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 236, 58, 26, 54, 20
"""Sizes of boxes and gaps [px]."""


@dataclass(frozen=True)
class Box:
    """A group and where it is drawn [px]."""

    title: str
    note: str
    x: float
    y: float


def group_modules() -> dict[str, tuple[str, ...]]:
    """Return the modules of each group by its title."""
    starts = [LAYERS.index(first) for first, _, _ in GROUPS]
    assert starts == sorted(starts), "GROUPS has to have the order of LAYERS"
    ends = [*starts[1:], len(LAYERS)]
    groups: dict[str, tuple[str, ...]] = {}
    for (_, title, _), start, end in zip(GROUPS, starts, ends, strict=True):
        for module in LAYERS[start:end]:
            owner = APART.get(module, title)
            groups[owner] = (*groups.get(owner, ()), module)
    return dict(sorted(groups.items(), key=lambda item: LAYERS.index(item[1][-1])))


def imports_of(module: str) -> set[str]:
    """Return the modules of the package that a module or folder imports."""
    folder, file = PACKAGE / module, PACKAGE / f"{module}.py"
    found = set()
    for path in sorted(folder.glob("*.py")) if folder.is_dir() else [file]:
        level = 2 if folder.is_dir() else 1
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.level == level:
                found |= {node.module.split(".")[0]} if node.module else {alias.name for alias in node.names}
    return found


def uses() -> dict[str, set[str]]:
    """Return the groups that each group uses, without what follows from others."""
    modules = group_modules()
    owner = {module: title for title, names in modules.items() for module in names}
    direct = {
        title: {owner[m] for name in names for m in imports_of(name) if m in owner} - {title}
        for title, names in modules.items()
    }
    below: dict[str, set[str]] = {}
    for title in modules:  # from the lowest up
        below[title] = direct[title].union(*(below[other] for other in direct[title]))
    return {
        title: {other for other in found if not any(other in below[third] for third in found - {other})}
        for title, found in direct.items()
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
            boxes[title] = Box(title, NOTES[title], left + k * (WIDTH + GAP_X), y)
    return list(boxes.values())


def picture() -> str:
    """Return the picture as SVG."""
    edges = uses()
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
    return [
        f'<rect x="{box.x:g}" y="{box.y:g}" width="{WIDTH}" height="{HEIGHT}" rx="8" fill="#eef1f6" stroke="#4361ee"/>',
        f'<text x="{middle:g}" y="{box.y + 24:g}" text-anchor="middle" font-size="16" font-weight="bold" '
        f'fill="#1b263b">{escape(box.title)}</text>',
        f'<text x="{middle:g}" y="{box.y + 44:g}" text-anchor="middle" font-size="11.5" fill="#415a77">'
        f"{escape(box.note)}</text>",
    ]


def main() -> int:
    """Write the picture, or compare it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="Only say whether the picture is current.")
    if not parser.parse_args().check:
        OUTPUT.write_text(picture(), encoding="utf-8")
        return 0
    current = OUTPUT.read_text(encoding="utf-8") == picture()
    if not current:
        sys.stderr.write(f"{OUTPUT} is out of date: run python scripts/make_architecture_picture.py\n")
    return 0 if current else 1


if __name__ == "__main__":
    sys.exit(main())
