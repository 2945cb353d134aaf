"""The paper's tables: the rows' contract, the pages, and that ours are no worse."""

import json

import pytest
from click.testing import CliRunner

from grasp_planner.cli import main
from grasp_planner.paper_tables import PAPER_CELLS

KEYS = {
    "table",
    "direction",
    "n_synergies",
    "weight_ratio",
    "feasible",
    "force_norm",
    "alignment_angle_deg",
    "alignment_degenerate",
    "iterations",
    "time_s",
    "max_violation",
    "paper",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("reproduce")
    arguments = ["reproduce", "--out", str(out)]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    return out


@pytest.mark.slow
def test_rows_follow_the_contract(folder):
    rows = json.loads((folder / "reproduce.json").read_text())
    assert len(rows) == len(PAPER_CELLS)
    for row, cell in zip(rows, PAPER_CELLS, strict=True):
        assert set(row) >= KEYS
        assert (row["table"], row["direction"], row["n_synergies"]) == (cell.table, cell.direction, cell.n_synergies)
        assert set(row["paper"]) == {"force_norm", "alignment_angle_deg", "iterations"}


@pytest.mark.slow
def test_every_cell_is_feasible_and_no_worse_than_the_papers(folder):
    for row in json.loads((folder / "reproduce.json").read_text()):
        assert row["feasible"]
        assert row["max_violation"] < 1e-6
        assert row["force_norm"] <= row["paper"]["force_norm"]
        assert row["alignment_angle_deg"] <= row["paper"]["alignment_angle_deg"]
        assert row["iterations"] <= 2 * row["paper"]["iterations"]


@pytest.mark.slow
def test_the_trade_off_goes_the_papers_way(folder):
    """A larger w_F/w_C gives less force."""
    rows = [row for row in json.loads((folder / "reproduce.json").read_text()) if row["table"] == 2]
    forces = [row["force_norm"] for row in sorted(rows, key=lambda row: row["weight_ratio"])]
    assert forces == sorted(forces, reverse=True)


@pytest.mark.slow
def test_the_page_is_complete_and_needs_nothing_else(folder):
    page = (folder / "reproduce.html").read_text()
    assert page.count("data:image/png;base64,") == 4
    assert 'src="http' not in page
    markdown = (folder / "reproduce.md").read_text()
    for name in ("figure_2_y", "figure_3_x", "convergence", "pareto"):
        assert f"{name}.png" in markdown
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
