"""Try every URDF of a folder as a new user would, with default options, and print a table.

    python scripts/check_hands.py FOLDER [--seconds 300] [--markdown table.md]

``hand check`` says which command plans a first grasp; that command is run as it stands (at most three synergies), and
again with as many synergies as the hand has motors (without a tendon: independent joints). What is planned is exported,
analysed and simulated from its file. Nothing is edited by hand. Every hand has a process of its own; processor time is
that of its commands, and the reason of a failing one is its last line.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import resource
import shlex
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from queue import Empty
from typing import Any

from click.testing import CliRunner

from grasp_planner.cli.main import main as grasp_planner
from grasp_planner.hand.description import read_hand_description
from grasp_planner.records.grasp_files import read_grasp_record
from grasp_planner.records.grasp_record import grasp_from_record

COLUMNS = ("hand", "motors", "check", "n_s", "feasible", "clear", "pushes held", "reopened", "CPU s", "what fails")
NONE = "–"
SAID = 140
"""Most characters of a reason."""
CLEAR = 1e-6
"""Largest overlap of links that are clear [m]."""
Row = dict[str, str]


def run(*arguments: str) -> tuple[int, str]:
    """Run a command line; return its exit code and what it printed."""
    answer = CliRunner().invoke(grasp_planner, list(arguments))
    if answer.exception is not None and not isinstance(answer.exception, SystemExit):
        return 1, f"{type(answer.exception).__name__}: {answer.exception}"
    return answer.exit_code, answer.output


def reason(text: str) -> str:
    """Return the last line of an output, cut."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return (lines[-1] if lines else "said nothing")[:SAID].replace("|", "/")


def processor_time() -> float:
    """Return the processor time of this process and of those it waited for [s]."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def tried(path: Path, folder: Path, say: Callable[[Row], None], *options: str, once: bool = False) -> None:
    """Try one URDF.

    Args:
        path: The URDF.
        folder: Where its files are written.
        say: Called with each row as far as it is known: one for the first plan, one for all motors where they are more.
        options: Further options of ``plan``.
        once: Whether only the first plan is tried.
    """
    began = processor_time()
    row = dict.fromkeys(COLUMNS, NONE) | {"hand": path.stem}

    def tell(**found: str) -> None:
        row.update({key.replace("_", " ") if key != "n_s" else key: value for key, value in found.items()})
        say(row | {"CPU s": f"{processor_time() - began:.0f}"})

    description = folder / "derived.toml"
    code, output = run("hand", "check", str(path), "--toml", str(description), "--force")
    if code:
        tell(check="no", what_fails=reason(output))
        return
    derived = read_hand_description(description)
    motors = len(derived.tendons.motors) if derived.tendons is not None else len(derived.joints)
    first = next(line for line in output.splitlines() if line.startswith("first grasp: "))
    command = [*shlex.split(first.removeprefix("first grasp: "))[1:], *options]
    tell(motors=str(motors), check="yes", what_fails="plan: no time left")
    usual = planned(command, folder, tell)
    if motors > usual and not once:
        began = processor_time()
        row |= dict.fromkeys(COLUMNS[3:], NONE)
        tell(n_s=str(motors), what_fails="plan: no time left")
        planned([*command, "--synergies", str(motors)], folder, tell)


def planned(command: list[str], folder: Path, tell: Callable[..., None]) -> int:
    """Plan, and open the file again with every command that takes one; return the number of synergies."""
    file = folder / "grasp.json"
    file.unlink(missing_ok=True)
    code, output = run(*command, "--json", str(file), "--no-explain")
    if code not in (0, 3) or not file.exists():
        tell(feasible="no", what_fails=reason(output))
        return 0
    record = read_grasp_record(file)
    overlaps = (record.violations[name].value for name in ("link_object", "self_collision"))
    tell(
        n_s=str(record.n_synergies),
        feasible="yes" if record.feasible else "no",
        clear="yes" if max(overlaps) <= CLEAR else "no",
        what_fails="" if record.feasible else reason(str(grasp_from_record(record).verdict)),
    )
    if record.feasible:
        tell(what_fails="simulate: no time left")
        simulated = folder / "simulation.json"
        code, output = run("simulate", str(file), "--no-ladder", "--out", str(simulated))
        found: dict[str, Any] = json.loads(simulated.read_text()) if code in (0, 3) else {}
        pushes = [each["held"] for each in found.get("directions", []) if each["kind"] == "force"]
        told = "" if code == 0 else reason(found.get("verdict", output))
        tell(pushes_held=f"{sum(pushes)} of {len(pushes)}" if pushes else "not simulated", what_fails=told)
        for words in (("export", "--html", str(folder / "grasp.html")), ("analyse", "--no-sensitivity")):
            code, output = run(words[0], str(file), *words[1:])
            if code:
                told = told or f"{words[0]}: {reason(output)}"
                tell(reopened="no", what_fails=told)
                break
        else:
            tell(reopened="yes")
    return record.n_synergies


def sent(path: Path, queue: multiprocessing.Queue[Row]) -> None:
    """Try one URDF and send what is known after each step."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            tried(path, Path(folder), queue.put)
        except Exception as error:
            row = dict.fromkeys(COLUMNS, NONE) | {"hand": path.stem}
            queue.put(row | {"what fails": reason(f"{type(error).__name__}: {error}")})


def rows_of(path: Path, seconds: float) -> list[Row]:
    """Return the rows of a URDF, tried in a process of its own that is given so long."""
    context = multiprocessing.get_context("spawn")
    queue: multiprocessing.Queue[Row] = context.Queue()
    process = context.Process(target=sent, args=(path, queue))
    process.start()
    nothing = dict.fromkeys(COLUMNS, NONE) | {"hand": path.stem, "what fails": "no answer in time"}
    rows: dict[str, Row] = {}

    def receive() -> None:
        with contextlib.suppress(Empty):
            while True:
                row = queue.get(timeout=0.5)
                rows.pop(NONE, None)
                rows[row["n_s"]] = row

    end = time.monotonic() + seconds
    while process.is_alive() and time.monotonic() < end:
        receive()
    if process.is_alive():
        process.terminate()
    process.join()
    receive()  # what it said last may still be on its way
    return list(rows.values()) or [nothing]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float, default=300.0, help="wall-clock time for each hand")
    parser.add_argument("--markdown", type=Path, help="write the table to this file")
    arguments = parser.parse_args()
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    print("\n".join(lines), flush=True)
    for path in sorted(arguments.folder.rglob("*.urdf")):
        for row in rows_of(path, arguments.seconds):
            lines.append("| " + " | ".join(row[column] for column in COLUMNS) + " |")
            print(lines[-1], flush=True)
    if arguments.markdown:
        arguments.markdown.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
