"""Starting is cheap: what is not needed is not imported, and what stands in for it says the same."""

import pickle
import subprocess
import sys

import click
import pytest

import grasp_planner as gp
from grasp_planner.cli.main import COMMANDS, main
from grasp_planner.files.public_names import listed_names, public_names

HEAVY = {"numpy", "pinocchio", "scipy", "trimesh", "pydantic", "rich", "viser", "matplotlib", "networkx", "coal", "igl"}
HEAVY |= {"manifold3d", "yourdfpy", "clarabel", "mujoco", "yaml", "pyarrow", "distributed", "duckdb", "PIL"}


def imported_by(code):
    """Return the first parts of the modules that a new Python has imported after some code."""
    end = "\nimport sys\nprint('\\n' + ' '.join({name.partition('.')[0] for name in sys.modules}))"
    finished = subprocess.run([sys.executable, "-c", code + end], capture_output=True, text=True, check=True)
    return set(finished.stdout.splitlines()[-1].split())


def command_line(*arguments):
    return f"from grasp_planner.cli.main import main\nmain({list(arguments)!r}, standalone_mode=False)"


def test_importing_the_package_imports_nothing_heavy():
    assert not HEAVY & imported_by("import grasp_planner")


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_help_and_version_import_nothing_heavy(option):
    assert not HEAVY & imported_by(command_line(option))


def test_a_plan_imports_no_meshes_pictures_or_pages():
    code = (
        "import grasp_planner as gp\n"
        "hand = gp.load_hand()\n"
        "problem = gp.GraspProblem.paper(hand, gp.parse_object('cylinder'))\n"
        "gp.plan_grasp(problem, options=gp.PlannerOptions(max_iterations=1, starts=1, enough=1))\n"
        "gp.GraspProblem(hand, gp.Sphere())"
    )
    unused = {"trimesh", "networkx", "igl", "manifold3d", "viser", "matplotlib", "rich", "PIL", "yourdfpy", "mujoco"}
    assert not unused & imported_by(code)


def test_the_list_of_commands_says_what_the_commands_say():
    context = click.Context(main)
    assert main.list_commands(context) == list(COMMANDS)
    for name, (*_, text) in COMMANDS.items():
        command = main.get_command(context, name)
        assert command.name == name
        assert command.get_short_help_str(1000) == text
    assert main.get_command(context, "no-such-command") is None


def test_the_help_lists_every_command():
    text = main.get_help(click.Context(main, info_name="grasp-planner"))
    for name, (*_, help_text) in COMMANDS.items():
        assert f"  {name} " in text
        assert help_text[:30] in text


def test_every_public_name_is_what_its_module_has():
    for package, name in ((room, name) for room in (gp, gp.model, gp.analysis) for name in room.__all__):
        assert name in dir(package)
        value = getattr(package, name)
        assert getattr(value, "__name__", "").rpartition(".")[2] == name
    with pytest.raises(AttributeError, match="no attribute 'no_such_name'"):
        gp.no_such_name  # noqa: B018 – asking for it is the test
    namespace = {}
    exec("from grasp_planner import *", namespace)
    assert set(gp.__all__) <= set(namespace)


def test_public_classes_go_through_pickle():
    assert pickle.loads(pickle.dumps(gp.Sphere(radius=0.02))).radius == 0.02
    assert pickle.loads(pickle.dumps(gp.GraspProblem)) is gp.GraspProblem


def test_a_stub_lists_names_and_modules(tmp_path):
    stub = tmp_path / "__init__.pyi"
    stub.write_text("import os\nfrom . import part as part\nfrom .part.leaf import Leaf as Leaf, twig as branch\n")
    assert listed_names(stub) == {
        "part": (".part", None),
        "Leaf": (".part.leaf", "Leaf"),
        "branch": (".part.leaf", "twig"),
    }
    names, _, listed = public_names("package", str(tmp_path / "__init__.py"))
    assert names == listed() == ["Leaf", "branch", "part"]
