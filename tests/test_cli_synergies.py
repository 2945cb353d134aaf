"""Synergy sets on the command line: listing, showing, fitting."""

import numpy as np
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.main import main


def run(*arguments):
    return CliRunner().invoke(main, ["synergies", *map(str, arguments)])


@pytest.fixture
def postures(tmp_path, right, rng):
    """A file of postures that vary along one direction only."""
    direction = np.linspace(1.0, 2.0, right.n_joints)
    rows = np.outer(rng.normal(size=30), direction / np.linalg.norm(direction))
    path = tmp_path / "postures.csv"
    lines = [",".join(reversed(right.joint_names)), *(",".join(f"{v:.9f}" for v in row[::-1]) for row in rows)]
    path.write_text("# degrees\n" + "\n".join(lines) + "\n")
    return path, direction / np.linalg.norm(direction)


def test_all_sets_of_the_hand_are_listed(right):
    result = run("list")
    assert result.exit_code == 0, result.output
    for name in right.synergy_set_names:
        assert name in result.output


def test_a_set_is_shown_and_drawn(tmp_path):
    picture = tmp_path / "strip.png"
    result = run("show", "native", "--count", 2, "--picture", picture)
    assert result.exit_code == 0, result.output
    assert "thumb_abd" in result.output
    assert "cumulative variance" in result.output
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_sets_are_compared_by_how_well_they_close(right):
    result = run("compare", "--counts", "3")
    assert result.exit_code == 0, result.output
    rows = {cells[0]: cells for line in result.output.splitlines() if (cells := line.split())}
    for name in right.synergy_set_names:
        enough = right.synergies(name).n_synergies >= 3
        assert (rows[name][1] == "3") if enough else (name not in rows)
    # The default set reaches the paper's cylinder with three synergies, every force within its cone.
    assert float(rows["santello"][-2]) < 0.5
    assert float(rows["santello"][-1]) > 0.0


def test_comparing_takes_few_synergies_only():
    result = run("compare", "--counts", "1,9")
    assert result.exit_code == 2
    assert "1 to 4" in result.output


def test_fitting_finds_the_direction_of_the_postures(tmp_path, postures, right):
    path, direction = postures
    out = tmp_path / "set.csv"
    result = run("fit", path, "--out", out, "--degrees", "--name", "line")
    assert result.exit_code == 0, result.output
    space = gp.load_synergies(out).reordered(right.joint_names)
    assert space.name == "line"
    np.testing.assert_allclose(np.abs(space.basis[:, 0] @ direction), 1.0, atol=1e-9)
    assert space.explained_variance()[0] > 1 - 1e-9
    assert run("show", out, "--count", 1).exit_code == 0


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "two postures"),
        ("a,b\n1,2\n3,4\n", "thumb_abd"),
        ("a,b\n1\n3,4\n", "row 2"),
        ("a,b\n1,x\n3,4\n", "column 'b'"),
        ("a,b\n1,nan\n3,4\n", "column 'b'"),
    ],
)
def test_bad_postures_are_one_clear_line(tmp_path, text, part):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    result = run("fit", path, "--out", tmp_path / "out.csv")
    assert result.exit_code == 2
    assert part in result.output
    assert result.output.startswith("grasp-planner: error: ")
    assert not (tmp_path / "out.csv").exists()


def test_unknown_sets_are_named():
    result = run("show", "nobody")
    assert result.exit_code == 2
    assert "native" in result.output
