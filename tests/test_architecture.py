"""Rooms import only lower ones, no file is in a circle, nothing grows too large."""

import ast
import subprocess
import sys

import pytest

from tests.architecture import FILES, PACKAGE, ROOMS, circles, note_of, uses

ENTRIES = {"__init__", "__main__"}


def test_every_room_has_its_place():
    modules = {path.stem for path in PACKAGE.glob("*.py")}
    folders = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert (modules | folders) - ENTRIES == set(ROOMS)
    assert len(modules - {"__main__"}) <= 5


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_says_what_it_holds_and_imports_only_lower_ones(room):
    assert note_of(room)
    assert uses()[room] <= set(ROOMS[: ROOMS.index(room)])


def test_search_and_judge_share_no_formula():
    used = uses()
    assert "judge" not in used["evaluation"]
    assert "evaluation" not in used["judge"]


def test_no_file_is_in_a_circle():
    assert not circles()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_files_and_functions_stay_small(path):
    text = path.read_text(encoding="utf-8")
    assert text.count("\n") <= 300
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            length = body[-1].end_lineno - body[0].lineno + 1 if body else 0
            assert length <= 60, f"{node.name}: {length} lines"


def test_nothing_is_printed_by_the_library():
    for path in FILES:
        calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        assert not [call for call in calls if getattr(call.func, "id", "") == "print"], path


def test_no_class_or_function_name_is_defined_twice():
    found = {}
    for path in FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
                found.setdefault(node.name, []).append(path.relative_to(PACKAGE).as_posix())
    assert not {name: places for name, places in found.items() if len(places) > 1}


def test_picture_and_tour_of_the_architecture_are_current():
    script = PACKAGE.parent / "scripts" / "make_architecture.py"
    checked = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stderr
