"""List what an installation brings along: every distribution that the package needs at run time, with its size.

``python scripts/list_closure.py`` asks the environment it runs in; ``--extra batch`` adds an extra, repeatable.
"""

from __future__ import annotations

import argparse
import re
import sys
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

PACKAGE = "grasp_planner"


def closure(extras: list[str]) -> dict[str, set[str]]:
    """Return the distributions that the package needs, itself included, and which of the others ask for each."""
    asked: dict[str, set[str]] = {PACKAGE: set()}
    waiting, seen = [(PACKAGE, extra) for extra in ("", *extras)], set()
    while waiting:
        name, extra = waiting.pop()
        if (name, extra) in seen:
            continue
        seen.add((name, extra))
        for text in metadata.requires(name) or []:
            needed = Requirement(text)
            if needed.marker is None or needed.marker.evaluate({"extra": extra}):
                inner = re.sub(r"[-_.]+", "-", needed.name).lower()
                asked.setdefault(inner, set()).add(name)
                waiting += [(inner, other) for other in ("", *needed.extras)]
    return asked


def size_of(name: str) -> int:
    """Return the bytes that a distribution takes on disk, by its own list of files; compiled Python left out."""
    found = metadata.distribution(name)
    paths = {Path(str(found.locate_file(file))) for file in found.files or []}
    return sum(path.stat().st_size for path in paths if path.is_file() and path.suffix != ".pyc")


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--extra", action="append", default=[])
    asked = closure(parser.parse_args().extra)
    sizes = {name: size_of(name) for name in asked}
    for name in sorted(asked, key=lambda name: -sizes[name]):
        sys.stdout.write(
            f"{sizes[name] / 1e6:8.1f} MB  {name} {metadata.version(name)}  {', '.join(sorted(asked[name]))}\n"
        )
    sys.stdout.write(f"{sum(sizes.values()) / 1e6:8.1f} MB  {len(asked)} distributions\n")


if __name__ == "__main__":
    main()
