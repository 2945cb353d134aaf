"""The last guard of the command line: whatever is raised is one line, with a report; long values are cut."""

import re
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli import crash
from grasp_planner.cli.main import COMMANDS, main
from grasp_planner.exceptions import FileFormatError, InvalidValueError, NameNotFoundError, cut, shown
from grasp_planner.hand.description import read_hand_description


class Panic(BaseException):
    """What PyO3 makes of a panic in a Rust library: no Exception."""


@pytest.fixture
def raising(monkeypatch, tmp_path):
    """Return what makes the command ``plan`` raise an error, and where reports go."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def run(error, *options):
        @click.command("plan")
        def command():
            raise error

        module = type(sys)("grasp_planner.cli.raising")
        module.command = command
        monkeypatch.setitem(sys.modules, module.__name__, module)
        monkeypatch.setitem(COMMANDS, "plan", (".raising", "command", ""))
        return CliRunner().invoke(main, [*options, "plan"])

    return run


@pytest.mark.parametrize(
    "error",
    [
        ValueError("not foreseen " + "x" * 5000),
        MemoryError(),
        RecursionError("maximum recursion depth exceeded"),
        UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
        OSError(28, "No space left on device"),
        KeyError("a\nb"),
        Panic("assertion failed"),
    ],
)
def test_anything_raised_is_one_line_and_a_report(raising, tmp_path, error):
    result = raising(error)
    assert result.exit_code == 70 and result.stderr.count("\n") == 1 and len(result.stderr) <= 330
    assert result.stderr.startswith("grasp-planner: error: plan failed unexpectedly")
    (report,) = (tmp_path / "grasp_planner" / "reports").iterdir()
    assert str(report) in result.stderr
    text = report.read_text()
    assert "Traceback" in text and type(error).__name__ in text and gp.__version__ in text


def test_debug_shows_the_traceback_and_keeps_the_exit_code(raising):
    unforeseen = raising(ValueError("oh"), "--debug")
    assert unforeseen.exit_code == 70 and "Traceback" in unforeseen.stderr
    foreseen = raising(InvalidValueError("mass", -1, "> 0"), "--debug")
    assert foreseen.exit_code == 2 and "Traceback" in foreseen.stderr
    assert raising(InvalidValueError("mass", -1, "> 0")).stderr == "grasp-planner: error: mass: got -1, allowed: > 0\n"


def test_where_no_report_can_be_written_the_line_still_comes(raising, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    result = raising(ValueError("oh"))
    assert result.exit_code == 70 and "--debug" in result.stderr and result.stderr.count("\n") == 1


def test_reports_do_not_pile_up(raising, tmp_path, monkeypatch):
    place = crash.reports_folder()
    place.mkdir(parents=True)
    for number in range(30):
        (place / f"20000101-0000{number:02d}-1.txt").touch()
    raising(ValueError("oh"))
    assert len(list(place.iterdir())) == crash.KEPT_REPORTS and max(place.iterdir()).stat().st_size > 0


@pytest.mark.parametrize(
    "value",
    ["a" * 5000, [[[[["x" * 90] * 9] * 9] * 9] * 9] * 9, {k: "y" * 50 for k in range(999)}, 10**5000, b"z" * 999],
    ids=["text", "nested", "mapping", "number", "bytes"],
)
def test_values_are_cut(value):
    assert len(shown(value)) <= 80
    assert len(str(InvalidValueError("f" * 999, value, "less"))) <= 200


def test_short_values_are_shown_as_they_are():
    for value in ("a'b", -1, 1.5, [1, 2], {"a": None}, (True,), None):
        assert shown(value) == repr(value)
    assert cut("a\n b", 10) == "a b" and cut("abcdef", 4) == "abc…" and cut("abcd", 4) == "abcd"
    assert "did you mean 'force'" in str(NameNotFoundError("kind", "forc", ["force"]))


@pytest.mark.parametrize(
    "arguments",
    [
        ["plan", "--hand", "h" * 5000],
        ["plan", "--object", "o" * 5000],
        ["plan", "--task", "t" * 5000],
        ["plan", "--" + "n" * 5000],
        ["c" * 5000],
        ["plan", "--friction", "9" * 5000],
        ["plan", "--stop-weight", "x" * 5000],
        ["plan", "--stop-weight", "x y " * 2000],
        ["plan", "--seed", "-1"],
        ["analyse", "/dev/zero"],
        ["export-rows", ".", "--out", "x", "--rows", "0-99999999999"],
        ["batch", "/dev/zero", "--dry-run"],
    ],
    ids=lambda arguments: " ".join(arguments)[:30],
)
def test_long_and_endless_arguments_are_short_errors(arguments, tmp_path):
    command = [sys.executable, "-m", "grasp_planner", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=60, check=False)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert max(map(len, done.stderr.splitlines())) <= 330, done.stderr
    assert not re.search(r"(.)\1{80}|(?:x y ){21}", done.stderr), "no value of more than 80 characters"


LONG = "n" * 5000
HAND = """<robot name="r"><link name="a"/><link name="{link}"/><joint name="{joint}" type="{kind}"><parent link="a"/>
<child link="{child}"/><axis xyz="0 0 1"/><limit lower="0" upper="{upper}"/>{mimic}</joint></robot>"""
GOOD = {"link": "b", "joint": "j", "kind": "revolute", "child": "b", "upper": "1", "mimic": ""}


@pytest.mark.parametrize(
    "changes",
    [
        {"link": LONG},
        {"joint": LONG, "upper": "x"},
        {"kind": LONG},
        {"child": LONG},
        {"mimic": f"<mimic joint='{LONG}'/>"},
        {"link": LONG, "child": LONG, "mimic": f"<visual><geometry><mesh filename='{LONG}.stl'/></geometry></visual>"},
    ],
    ids=lambda changes: " ".join(changes),
)
def test_long_names_in_a_urdf_are_cut(tmp_path, changes):
    path = tmp_path / "hand.urdf"
    path.write_text(HAND.format(**{**GOOD, **changes}))
    with pytest.raises(gp.GraspPlannerError) as refused:
        gp.load_hand(path)
    assert len(str(refused.value)) < 300 + len(str(path))


def test_long_keys_and_values_of_a_description_are_cut(tmp_path):
    for text in (f"name = '{LONG}'\nurdf = 3\n", f"urdf = '{LONG}'\n{LONG} = 1\n", f"joints = '{LONG}'\n"):
        (tmp_path / "hand.toml").write_text(text)
        with pytest.raises(FileFormatError) as refused:
            read_hand_description(tmp_path / "hand.toml")
        assert len(str(refused.value)) < 400 + len(str(tmp_path))


def test_of_a_long_path_the_end_is_shown_and_the_reason_always():
    assert str(FileFormatError("a/b.txt", "is empty")) == "a/b.txt: is empty"
    message = str(FileFormatError("x" * 5000 + "/hand.urdf", "is empty"))
    assert message.startswith("…xxx") and message.endswith("x/hand.urdf: is empty") and len(message) == 170
