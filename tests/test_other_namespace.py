"""The batch on a second library of arrays: its rows are NumPy's, and NumPy judges what its phase one finds.

In processes of their own: JAX has threads, and a process with threads must not be copied, as other tests do.
"""

import os
import re
import subprocess
import sys

import pytest

from .architecture import FILES
from .scripts import FOLDER


def table_of(*words: str) -> list[list[str]]:
    """Return the lines of the table that the script prints, as cells; without optimising, which compiles faster."""
    command = [sys.executable, str(FOLDER / "other_namespace.py"), *words]
    environment = {**os.environ, "XLA_FLAGS": "--xla_backend_optimization_level=0", "JAX_PLATFORMS": "cpu"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in done.stdout.splitlines()[2:]]


@pytest.mark.slow
def test_compiled_rows_are_those_of_numpy():
    """Compiled, no function of NumPy's can be called on the way."""
    table = table_of("rows")
    names = {shape: {row[1] for row in table if row[0] == shape} for shape in ("sphere", "cylinder", "box")}
    everywhere = {"surface", "compliance", "friction", "load_friction", "link_object", "self_collision", "ground"}
    assert all(everywhere <= held for held in names.values())
    assert "region" in names["cylinder"] and "edge" in names["box"]
    for _, name, library, value, slope in table:
        assert library == "jaxlib float64"
        assert max(float(value), float(slope)) < 1e-10, name


@pytest.mark.slow
def test_phase_one_finds_what_numpy_calls_feasible():
    table = table_of("search")
    assert len(table) == 3
    for _, library, worst, name in table:
        assert library == "jaxlib"
        assert float(worst) <= 1.01e-6, name  # SOLVED, and rounding


def test_the_product_does_without_it():
    assert not [path for path in FILES if re.search(r"^\s*(import|from) jax\b", path.read_text("utf-8"), re.MULTILINE)]
