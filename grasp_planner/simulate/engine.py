"""MuJoCo, loaded only when something is simulated: an optional extra."""

from __future__ import annotations

import importlib
from typing import Any

from ..exceptions import GraspPlannerError


class SimulationDependencyError(GraspPlannerError):
    """A package that simulation needs is not installed.

    Args:
        package: Name of the package.
    """

    def __init__(self, package: str) -> None:
        super().__init__(f"simulation needs {package}: install grasp_planner[simulate]")


def load_mujoco() -> Any:
    """Return the module ``mujoco``.

    Raises:
        SimulationDependencyError: If it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ImportError:
        raise SimulationDependencyError("mujoco") from None
