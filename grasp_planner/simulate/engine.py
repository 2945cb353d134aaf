"""MuJoCo, loaded only when something is simulated: an optional extra."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
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


@contextmanager
def quiet_warnings() -> Iterator[None]:
    """Keep MuJoCo from printing warnings and writing MUJOCO_LOG.TXT; a simulation that diverges is seen by its pose."""
    mujoco = load_mujoco()
    if not hasattr(mujoco, "set_mju_user_warning"):
        yield
        return
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
