"""The commands from end to end, and what they say when the disk does not play along."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from grasp_planner import read_grasp_record
from grasp_planner.batch import CaseTable, load_table, read_spec
from grasp_planner.cli.batch import batch_command, export_command, parse_rows, progress_text, report_command

SPEC = """
defaults: {paper: true, object: cylinder, starts: 3, enough: 1}
blocks: [{product: {object.radius: [0.025, 0.035], n_synergies: [5, 15]}}]
"""
QUICK = "blocks: [{fixed: {paper: true}, product: {seed: {from: 0, to: 59}}}]"
ROOT = Path(__file__).parents[2]


def invoke(command, *arguments):
    return CliRunner().invoke(command, [str(argument) for argument in arguments])


@pytest.mark.slow
def test_batch_report_and_export_end_to_end(run, write_spec, tmp_path):
    folder = tmp_path / "runs" / "name"
    done = run("batch", write_spec(SPEC), "--out", folder, "--workers", 2)
    assert done.returncode == 0, done.stderr
    assert "4 of 4 cases done (4 now" in done.stdout
    assert json.loads((folder / "run.json").read_text())["spec"] == SPEC
    report = run("report", folder, "--pictures", 1)
    assert report.returncode == 0 and (folder / "report.html").stat().st_size > 50_000
    feasible = [values["row"] for values in load_table(folder).to_pylist() if values["feasible"]]
    exported = run("export-rows", folder, "--out", tmp_path / "out")
    assert f"{len(feasible)} rows in {len(feasible)} files" in exported.stdout
    files = sorted((tmp_path / "out").glob("*.json"))
    assert [path.name for path in files] == [f"row-{row:06d}.json" for row in feasible]
    assert read_grasp_record(files[0]).feasible


def test_dry_run_shows_the_first_cases_and_writes_nothing(write_spec, tmp_path):
    shown = invoke(batch_command, write_spec(SPEC), "--dry-run", "--out", tmp_path / "run")
    assert shown.exit_code == 0 and shown.output.startswith("4 cases\n  0: dlr_hit_ii_right cylinder:")
    assert "n_synergies=5" in shown.output and not (tmp_path / "run").exists()
    assert "and 55 more" in invoke(batch_command, write_spec(QUICK), "--dry-run").output


def test_errors_are_one_line(write_spec, tmp_path):
    wrong = invoke(batch_command, write_spec("blocks: [{fixed: {sed: 1}}]"), "--dry-run")
    assert wrong.exit_code == 2 and wrong.output.count("\n") == 1 and "blocks[0].fixed.sed (line 1)" in wrong.output
    assert "Missing option '--out'" in invoke(batch_command, write_spec(QUICK)).output
    for command in (report_command, export_command):
        missing = invoke(command, tmp_path, *(["--out", tmp_path / "o"] if command is export_command else []))
        assert missing.exit_code == 2 and "no run here" in missing.output


@pytest.mark.parametrize(("text", "rows"), [("3", [3]), ("0,4,10-12", [0, 4, 10, 11, 12]), (" 1 , 2-2", [1, 2])])
def test_lists_of_rows(text, rows):
    assert parse_rows(text) == rows


@pytest.mark.parametrize("text", ["a", "1-", "-3", "1,,2"])
def test_malformed_lists_of_rows(text):
    with pytest.raises(ValueError, match="numbers and ranges"):
        parse_rows(text)


def test_progress_in_words():
    from grasp_planner.batch import BatchProgress

    assert progress_text(BatchProgress(100, 50, 0, 25, 2.0, 3725.0, 25.0)) == (
        "2.00 cases/s · 50 % feasible · 1:02:05 left"
    )
    assert progress_text(BatchProgress(100, 0, 0, 0, None, None, 0.0)) == "– · – · –"


def test_unwritable_output_is_one_error(run, write_spec, tmp_path):
    (tmp_path / "file").touch()
    for place in (tmp_path / "file" / "run", "/proc/nowhere"):
        failed = run("batch", write_spec(QUICK), "--out", place)
        assert failed.returncode == 2 and failed.stderr.count("\n") == 1
        assert "can't be written" in failed.stderr and str(place) in failed.stderr


@pytest.mark.slow
def test_full_disk_is_one_error_and_earlier_rows_stay(run, write_spec, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=150k", "tmpfs", str(disk)]
    if not shutil.which("mount") or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a small disk can't be mounted here")
    try:
        options = ("--out", disk / "run", "--planner", "batch_hooks:quick")
        failed = run("batch", write_spec(QUICK), *options)
        assert failed.returncode == 2 and failed.stderr.count("\n") == 1, failed.stderr
        assert "No space left on device" in failed.stderr and "Traceback" not in failed.stderr
        rows = load_table(disk / "run")["row"].to_pylist()
        assert 5 < len(rows) < 60 and len(set(rows)) == len(rows)
        subprocess.run(["mount", "-o", "remount,size=20m", str(disk)], check=True)
        done = run("batch", write_spec(QUICK), *options)
        assert done.returncode == 0 and f"({60 - len(rows)} now" in done.stdout, done.stderr
        assert load_table(disk / "run")["row"].to_pylist() == list(range(60))
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_file_size_limit_is_one_error_and_earlier_rows_stay(command, write_spec, tmp_path):
    folder, spec = tmp_path / "run", write_spec(QUICK)
    words = command("batch", spec, "--out", folder, "--planner", "batch_hooks:quick")
    limited = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000)); " + words[2]
    failed = subprocess.run([words[0], "-c", limited, *words[3:]], capture_output=True, text=True, check=False)
    assert failed.returncode == 2 and "File too large" in failed.stderr and failed.stderr.count("\n") == 1
    rows = load_table(folder)["row"].to_pylist()
    assert 5 < len(rows) < 60 and len(set(rows)) == len(rows)


@pytest.mark.parametrize("name", ["batch_cylinders.yaml", "batch_samples.yaml"])
def test_worked_examples_make_cases(name):
    table = CaseTable(read_spec(ROOT / "scripts" / name))
    table.check()
    assert len(table) > 10


@pytest.mark.slow
def test_script_runs(tmp_path):
    script = [sys.executable, str(ROOT / "scripts" / "run_batch.py"), "--out", str(tmp_path / "run")]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "feasible" in done.stdout and (tmp_path / "run" / "results").is_dir()
