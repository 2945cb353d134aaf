"""The layers: a module imports only modules below it; public names are documented; nothing grows too large."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import grasp_planner as gp

PACKAGE = Path(gp.__file__).parent
LAYERS = (
    "exceptions",
    "text_file",
    "spatial",
    "synergies",
    "urdf_checks",
    "urdf_file",
    "joint_coupling",
    "hand_description",
    "hand",
    "link_shapes",
    "kinematics",
    "objects",
    "contacts",
    "compliance",
    "friction",
    "task",
    "force_closure",
    "clearance_options",
    "load_cases",
    "size_check",
    "problem",
    "variables",
    "contact_geometry",
    "force_distribution",
    "coal_distances",
    "distances",
    "clearance",
    "load_response",
    "state",
    "terms",
    "load_terms",
    "clearance_terms",
    "nlp",
    "kkt",
    "kkt_path",
    "feasibility",
    "program",
    "phase_one",
    "starts",
    "preparation",
    "clearance_check",
    "load_check",
    "margins",
    "stability",
    "search_report",
    "grasp",
    "planner",
    "compact_synergies",
    "closing",
    "tolerance",
    "improve",
    "optimality_program",
    "problem_parameters",
    "validity",
    "post_optimality",
    "retreat",
    "why_not",
    "record_layout",
    "record_parts",
    "record",
    "analysis_record",
    "meshes",
    "picture",
    "fingertips",
    "palm_guess",
    "hand_check",
    "hand_proposal",
    "paper_tables",
    "reproduce",
    "page_parts",
    "reproduce_page",
    "benchmark_problems",
    "benchmark",
    "simulate",
    "study_margins",
    "synergy_study",
    "study_statistics",
    "synergy_study_plots",
    "synergy_study_page",
    "batch",
    "viewer",
    "cli_loads",
    "cli_options",
    "cli_margins",
    "cli_output",
    "cli_plan",
    "cli_analyse",
    "cli_bench",
    "cli_reproduce",
    "cli_hand",
    "cli_synergies",
    "cli_batch",
    "cli_view",
    "cli_simulate",
    "cli_study",
    "cli",
)
BESIDE = {"human_hand", "retargeting", "__init__", "__main__"}
"""Modules beside the flow, checked for their own imports only."""

FILES = sorted(PACKAGE.rglob("*.py"))


def imported(path, level):
    """Return the modules of the package that a file imports, a number of folders up."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level == level]
    names = set()
    for node in nodes:
        names |= {node.module.split(".")[0]} if node.module else {alias.name for alias in node.names}
    return names


def test_every_module_has_its_place():
    modules = {path.stem for path in PACKAGE.glob("*.py")}
    packages = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert (modules | packages) - set(LAYERS) - BESIDE == set()


@pytest.mark.parametrize("name", LAYERS)
def test_lower_layers_do_not_import_higher_ones(name):
    allowed = set(LAYERS[: LAYERS.index(name)]) | {"__version__"}
    folder, file = PACKAGE / name, PACKAGE / f"{name}.py"
    for path in sorted(folder.glob("*.py")) if folder.is_dir() else [file]:
        assert imported(path, level=2 if folder.is_dir() else 1) <= allowed, path.name


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_files_and_functions_stay_small(path):
    text = path.read_text(encoding="utf-8")
    assert text.count("\n") <= 320
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            length = body[-1].end_lineno - body[0].lineno + 1 if body else 0
            assert length <= 60, f"{node.name}: {length} lines"


def test_nothing_is_printed_by_the_library():
    for path in FILES:
        calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
        assert not [call for call in calls if getattr(call.func, "id", "") == "print"], path


def test_public_names_exist_and_are_documented():
    for name in vars(gp):
        value = getattr(gp, name)
        if not name.startswith("_") and callable(value):
            assert value.__doc__, name


def test_the_picture_of_the_architecture_is_current():
    script = PACKAGE.parent / "scripts" / "make_architecture_picture.py"
    checked = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stderr
