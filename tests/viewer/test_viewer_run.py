"""Going through a batch run in the viewer: by its tab, by links of the report, with rows that have no grasp."""

import http.client

import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.batch import GraspCase, RunFilter, RunRows, run_batch
from grasp_planner.cli.main import main
from grasp_planner.records.grasp_record import grasp_record
from grasp_planner.viewer import GraspViewer

NAVIGATION = {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
QUICK = {"starts": 3, "enough": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of four planned rows, one stopped at its time limit, and one whose object does not exist."""
    cases = [
        GraspCase(object=f"cylinder:radius={radius}", task=(task,), n_synergies=15, settings=QUICK)
        for radius in (0.028, 0.032)
        for task in ("force:+y", "force:+x")
    ]
    cases.append(GraspCase(n_synergies=3, time_limit_s=0.001))
    cases.append(GraspCase(object="<b>banana</b>", n_synergies=3))
    path = tmp_path_factory.mktemp("runs") / "some & run"
    run_batch(cases, path, workers=1)
    return path


@pytest.fixture(scope="module")
def run_viewer(folder):
    """A viewer of the run."""
    running = GraspViewer(rows=RunRows(folder, row=0))
    assert running.worker.drain(30.0)
    yield running
    running.stop()


@pytest.fixture
def viewer_of_run(run_viewer):
    """The viewer of the run at row 0 with no filter."""
    for widget in run_viewer.run.panel.filters.values():
        widget.value = "all"
    run_viewer.run.panel.order.value = "row"
    run_viewer.run.panel.number.value = 0
    settle(run_viewer)
    return run_viewer


def settle(viewer):
    assert viewer.worker.drain(30.0)


def ask(viewer, path, headers=NAVIGATION):
    """Open a page as a browser would, without one."""
    connection = http.client.HTTPConnection("127.0.0.1", viewer.server.get_port(), timeout=10)
    connection.request("GET", path, headers=headers)
    status = connection.getresponse().status
    connection.close()
    settle(viewer)
    return status


def test_rows_are_filtered_and_sorted(folder):
    rows = RunRows(folder)
    assert rows.values(rows.row)["status"] == "feasible"
    assert rows.choices["task"] == ("force:+x", "force:+y")
    assert set(rows.choices["status"]) >= {"feasible", "timeout", "error"}
    rows.choose(RunFilter({"task": "force:+x", "n_synergies": "all"}))
    assert rows.shown == [1, 3]
    rows.choose(RunFilter({"n_synergies": "15"}, "F"))
    forces = [rows.values(row)["force_norm"] for row in rows.shown]
    assert len(forces) == 4
    assert forces == sorted(forces)
    rows.choose(RunFilter({}, "F"))
    assert set(rows.shown[-2:]) == {4, 5}, "rows without a grasp come last"


def test_steps_stay_within_what_is_shown(folder):
    rows = RunRows(folder, row=0)
    rows.choose(RunFilter({"task": "force:+x"}))
    assert rows.place is None
    rows.step(1)
    assert rows.row == 1
    rows.step(1)
    rows.step(1)
    assert rows.row == 3
    rows.step(-99)
    assert rows.row == 1


def test_what_does_not_exist_is_refused(folder):
    rows = RunRows(folder)
    with pytest.raises(gp.InvalidValueError, match="row: got 99"):
        rows.select(99)
    with pytest.raises(gp.InvalidValueError, match="column: got 'secret'"):
        rows.choose(RunFilter({"secret": "x"}))
    with pytest.raises(gp.InvalidValueError, match="order: got 'x'"):
        rows.choose(RunFilter({}, "x"))
    with pytest.raises(gp.InvalidValueError, match="from 0 to 5"):
        RunRows(folder, row=6)
    with pytest.raises(gp.InvalidValueError, match="a condition that rows"):
        RunRows(folder, where="force_norm > 1e9")


def test_a_condition_limits_the_rows(folder):
    rows = RunRows(folder, where="feasible and task = 'force:+y'")
    assert rows.shown == [0, 2]
    assert rows.row == 0
    with pytest.raises(gp.InvalidValueError):
        rows.select(1)


def test_the_page_goes_through_the_rows(viewer_of_run):
    viewer, panel = viewer_of_run, viewer_of_run.run.panel
    assert "row 0 of some & run: feasible" in viewer.session.note
    panel.step.value = "next"
    settle(viewer)
    assert viewer.run.rows.row == panel.number.value == 1
    assert viewer.session.problem.tasks[0].text == "force:1,0,0"
    record = viewer.run.rows.values(1)
    assert viewer.session.grasp.force_norm == pytest.approx(record["force_norm"], rel=1e-9)
    assert grasp_record(viewer.session.grasp).feasible == record["feasible"]
    panel.step.value = "last"
    settle(viewer)
    assert viewer.run.rows.row == 5
    panel.number.value = 2
    settle(viewer)
    assert "Row 2" in panel._title.content
    assert viewer.session.problem.grasp_object.radius == 0.032


def test_filters_of_the_page(viewer_of_run):
    viewer, panel = viewer_of_run, viewer_of_run.run.panel
    panel.filters["task"].value = "force:+x"
    settle(viewer)
    assert viewer.run.rows.shown == [1, 3]
    assert viewer.run.rows.row == 1, "the first that is left"
    assert "1 of 2 shown" in panel._title.content
    panel.filters["status"].value = "timeout"
    settle(viewer)
    assert "No row meets the filter" in panel._list.content


def test_a_row_without_a_grasp_says_why(viewer_of_run):
    viewer, panel = viewer_of_run, viewer_of_run.run.panel
    panel.number.value = 4
    settle(viewer)
    assert "timeout; no grasp" in viewer.session.note
    assert "data-model='broken'" in viewer.card.widget.content
    assert "stopped at its limit" in panel._values.content
    before = viewer.session.grasp
    panel.number.value = 5
    settle(viewer)
    assert "banana" in viewer.share.last_error
    assert viewer.session.grasp is before
    assert "<b>banana" not in panel._values.content
    assert "&lt;b&gt;banana" in panel._values.content


def test_a_link_opens_its_row(viewer_of_run):
    viewer = viewer_of_run
    assert ask(viewer, f"/?run={viewer.run.rows.spec_hash[:16]}&row=3") == 200
    assert viewer.run.rows.row == 3
    assert "row 3" in viewer.session.note
    assert ask(viewer, "/?row=2&fixedDpr=1") == 200
    assert viewer.run.rows.row == 2


@pytest.mark.parametrize(
    "query", ["run=0123456789abcdef&row=3", "run=&row=x", "row=99", "row=-1", "row=" + "9" * 4000, "row=%00", "run=a"]
)
def test_a_link_to_what_is_not_here_changes_nothing(viewer_of_run, query):
    viewer = viewer_of_run
    assert ask(viewer, f"/?{query}") == 200
    assert viewer.run.rows.row == 0


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"},
        {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"},
    ],
)
def test_pages_that_fetch_or_embed_the_address_change_nothing(viewer_of_run, headers):
    ask(viewer_of_run, "/?row=3", headers)
    assert viewer_of_run.run.rows.row == 0


def test_a_link_to_a_viewer_without_a_run_says_so(viewer):
    ask(viewer, "/?row=3")
    assert "started with its folder" in viewer.share.last_error


def test_keys_step_through_the_run(viewer_of_run):
    viewer_of_run.worker.submit(lambda: viewer_of_run._step(1))
    settle(viewer_of_run)
    assert viewer_of_run.run.rows.row == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--row", "9"], "from 0 to 5"),
        (["--filter", "no_such = 1"], "a condition in SQL"),
        (["--filter", "1=1; drop table rows"], "a condition in SQL"),
    ],
)
def test_wrong_rows_and_filters_end_with_one_line(folder, arguments, words):
    result = CliRunner().invoke(main, ["view", str(folder), "--no-open", *arguments])
    assert result.exit_code == 2
    assert words in result.output
    assert result.output.count("\n") == 1


def test_rows_and_filters_need_a_run():
    for arguments in (["--row", "1"], ["--filter", "feasible"]):
        result = CliRunner().invoke(main, ["view", "--no-open", *arguments])
        assert result.exit_code == 2
        assert "folder of a batch run" in result.output


def test_a_run_that_goes_on_can_be_read_again(tmp_path):
    cases = [GraspCase(n_synergies=3, time_limit_s=0.001, seed=seed) for seed in range(3)]
    done = [0]
    run_batch(cases, tmp_path, workers=1, cancel=lambda: done[0] > 0, on_progress=lambda p: done.__setitem__(0, p.done))
    rows = RunRows(tmp_path)
    before = rows.count
    run_batch(cases, tmp_path, workers=1)
    rows.reload()
    assert before < rows.count == 3
