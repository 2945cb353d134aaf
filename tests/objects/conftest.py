"""Tests keep their caches to themselves."""

from __future__ import annotations

import pytest

from .helpers import make_bracket, make_mug, make_torus


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory):
    """Distance grids of this run go to a folder of their own."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        yield folder


@pytest.fixture(scope="session")
def mesh_texts(tmp_path_factory):
    """Text forms of three meshes by name."""
    folder = tmp_path_factory.mktemp("meshes")
    return {
        "torus": f"mesh:{make_torus(folder)},mass=0.15",
        "mug": f"mesh:{make_mug(folder)},scale=0.001,density=2000",
        "bracket": f"mesh:{make_bracket(folder)},mass=0.1",
    }
