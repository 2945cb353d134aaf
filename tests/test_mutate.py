"""The list of scripts/mutate.py does not rot: every change still applies, and there are thirty."""

import importlib.util
import sys

import pytest

from tests.architecture import PACKAGE

SPEC = importlib.util.spec_from_file_location("mutate", PACKAGE.parent / "scripts" / "mutate.py")
mutate = importlib.util.module_from_spec(SPEC)
sys.modules["mutate"] = mutate
SPEC.loader.exec_module(mutate)


@pytest.mark.parametrize("mutation", mutate.MUTATIONS, ids=lambda mutation: mutation.new)
def test_a_mutation_applies_once_and_changes_its_file(mutation):
    assert mutate.applied(mutation, PACKAGE) != (PACKAGE / mutation.file).read_text(encoding="utf-8")
    assert all((PACKAGE.parent / test).is_file() for test in mutation.tests)


def test_there_are_thirty():
    assert len(mutate.MUTATIONS) >= 30
