"""The paper's tables: the rows' contract, the pages, and that ours are no worse."""

import json

import pytest
from click.testing import CliRunner

from grasp_planner.cli import reproduce as cli_reproduce
from grasp_planner.cli.main import main
from grasp_planner.studies import reproduce
from grasp_planner.studies.paper_tables import PAPER_CELLS
from grasp_planner.studies.reproduce_page import PLAIN

KEYS = {
    "table",
    "direction",
    "n_synergies",
    "weight_ratio",
    "feasible",
    "force_norm",
    "alignment_angle_deg",
    "all_iterations",
    "single_runs_feasible",
    "iterations",
    "time_s",
    "max_violation",
    "paper",
}


@pytest.mark.slow
def test_the_papers_tables(tmp_path):
    """One test, so that the tables, which take a minute, are made once."""
    arguments = ["reproduce", "--synergy-sets", "native", "--single-runs", "1", "--out", str(tmp_path)]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    rows_follow_the_contract(tmp_path)
    every_cell_is_feasible_and_no_worse_than_the_papers(tmp_path)
    the_trade_off_goes_the_papers_way(tmp_path)
    the_page_is_complete_and_needs_nothing_else(tmp_path)


def rows_follow_the_contract(folder):
    rows = json.loads((folder / "reproduce.json").read_text())
    assert len(rows) == len(PAPER_CELLS)
    for row, cell in zip(rows, PAPER_CELLS, strict=True):
        assert set(row) >= KEYS
        assert (row["table"], row["direction"], row["n_synergies"]) == (cell.table, cell.direction, cell.n_synergies)
        assert set(row["paper"]) == {"force_norm", "alignment_angle_deg", "iterations"}


def every_cell_is_feasible_and_no_worse_than_the_papers(folder):
    for row in json.loads((folder / "reproduce.json").read_text()):
        assert row["feasible"]
        assert row["max_violation"] < 1e-6
        assert row["force_norm"] <= row["paper"]["force_norm"]
        angle = row["alignment_angle_deg"]  # None where the ellipsoid has no longest axis
        assert angle is None or angle <= row["paper"]["alignment_angle_deg"]
        assert row["all_iterations"] >= row["iterations"] + row["phase_one_iterations"]
        assert row["single_runs_feasible"] <= row["single_runs"] == 1
        assert row["iterations"] <= 2 * row["paper"]["iterations"]


def the_trade_off_goes_the_papers_way(folder):
    """A larger w_F/w_C gives less force."""
    rows = [row for row in json.loads((folder / "reproduce.json").read_text()) if row["table"] == 2]
    forces = [row["force_norm"] for row in sorted(rows, key=lambda row: row["weight_ratio"])]
    assert forces == sorted(forces, reverse=True)


def the_page_is_complete_and_needs_nothing_else(folder):
    page = (folder / "reproduce.html").read_text()
    assert page.count("data:image/png;base64,") == 4
    assert 'src="http' not in page
    markdown = (folder / "reproduce.md").read_text()
    for name in ("figure_2_y", "figure_3_x", "convergence", "pareto"):
        assert f"{name}.png" in markdown
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_with_clearance_the_page_says_so(tmp_path, monkeypatch):
    """Two cells with links clear: the synergies are those for clearance, and both remarks hold."""
    cells = [cell for cell in PAPER_CELLS if cell.n_synergies == 15]
    for module in (reproduce, cli_reproduce):
        monkeypatch.setattr(module, "PAPER_CELLS", cells)
    monkeypatch.setattr(reproduce, "PARETO_RATIOS", (1e-6,) * 4)
    options = ["--starts", "6", "--enough", "1", "--single-runs", "0", "--out", str(tmp_path)]
    result = CliRunner().invoke(main, ["reproduce", "--clearance", "links", *options])
    assert result.exit_code == 0, result.output
    rows = json.loads((tmp_path / "reproduce.json").read_text())
    assert [row["feasible"] for row in rows] == [True] * len(cells)
    assert {row["synergy_set"] for row in rows} == {"native_free"}
    for page in ("reproduce.md", "reproduce.html"):
        text = (tmp_path / page).read_text()
        assert "clearance links" in text and "Remarks 1 and 2 are on" in text and PLAIN not in text
