"""A short run of the fuzzing script; the long one is by hand."""

import importlib.util
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / "scripts" / "fuzz.py"


def load_script():
    """Return the script as a module."""
    spec = importlib.util.spec_from_file_location("fuzz_script", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_damaged_inputs_are_values_or_typed_errors():
    report = load_script().fuzz(400, 2)
    assert not report["broken"]
    assert 0 < report["refused"] < 400, "some are refused, some are still good"


def test_the_script_sees_what_breaks(monkeypatch):
    script = load_script()
    monkeypatch.setattr(script, "doors", lambda: {"bad": (lambda data, folder: 1 / 0, b"good")})
    assert len(script.fuzz(3, 0)["broken"]) == 3
