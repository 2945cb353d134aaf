"""Public names: few, documented, and the same for people and for type checkers."""

import ast
from pathlib import Path

import pytest

import grasp_planner as gp


def test_public_names_are_few_and_documented():
    assert len(gp.__all__) <= 40, "formulas stand in grasp_planner.model, analyses in grasp_planner.analysis"
    for package in (gp, gp.model, gp.analysis):
        for name in package.__all__:
            assert getattr(package, name).__doc__, name


@pytest.mark.parametrize("package", [gp, gp.model, gp.analysis], ids=lambda package: package.__name__)
def test_a_type_checker_sees_every_public_name(package):
    stub = Path(package.__file__).with_suffix(".pyi")
    imported = [node for node in ast.walk(ast.parse(stub.read_text())) if isinstance(node, ast.ImportFrom)]
    named = {alias.asname or alias.name for node in imported for alias in node.names}
    assert set(package.__all__) <= named | {"__version__"}
