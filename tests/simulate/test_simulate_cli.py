"""``grasp-planner simulate``: tables, exit codes, files, errors in one line; runs of many grasps; the animation."""

import json
import sys
from dataclasses import replace

import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.main import main
from grasp_planner.records.grasp_files import grasp_json
from grasp_planner.simulate import simulate_grasp
from tests.stored import FOLDER


@pytest.fixture
def result(held, tmp_path):
    path = tmp_path / "held.json"
    path.write_text(grasp_json(held), encoding="utf-8")
    return path


def invoke(*arguments):
    return CliRunner().invoke(main, ["simulate", *map(str, arguments)])


def test_a_grasp_that_holds(result, tmp_path):
    out, scene = tmp_path / "sim.json", tmp_path / "scene.xml"
    done = invoke(result, "--geometry", "contacts", "--squeeze", "2", "--no-ladder", "--out", out, "--mjcf", scene)
    assert done.exit_code == 0, done.output
    assert "passed: 6 of 6" in done.output
    record = json.loads(out.read_text(encoding="utf-8"))
    assert record["passed"]
    assert len(record["directions"]) == 12
    assert record["contacts"] == ["thumb", "index", "middle", "ring", "little"]
    assert scene.read_text(encoding="utf-8").startswith("<mujoco")


def test_a_grasp_that_does_not_hold(result):
    done = invoke(result, "--geometry", "contacts", "--friction", "0.2", "--no-ladder")
    assert done.exit_code == 3
    assert "failed" in done.output


def test_a_refused_grasp_says_what_to_do(planned, tmp_path):
    path = tmp_path / "plain.json"
    path.write_text(grasp_json(planned), encoding="utf-8")
    done = invoke(path)
    assert done.exit_code == 3
    assert "refused" in done.output
    assert "--geometry contacts" in done.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere.json"], "nowhere.json"),
        ([], "RESULT or --run"),
        (["{result}", "--squeeze", "-1"], "squeeze"),
        (["{result}", "--mass", "0"], "mass"),
        (["{result}", "--out", "nowhere/sim.json"], "no folder"),
        (["{result}", "--protocol", "wind"], "wind"),
        (["--run", "nowhere"], "nowhere"),
        (["--run", "nowhere", "--html", "a.html"], "--html"),
    ],
)
def test_mistakes_are_one_line(result, arguments, message):
    done = invoke(*(argument.format(result=result) for argument in arguments))
    assert done.exit_code == 2
    assert message in done.output
    assert "Traceback" not in done.output


def test_without_mujoco_it_says_how_to_install_it(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    done = invoke(result)
    assert done.exit_code == 2
    assert "install grasp_planner[simulate]" in done.output
    assert "Traceback" not in done.output


@pytest.mark.slow
def test_a_run_is_simulated_beside_its_grasps_and_goes_on(tmp_path):
    from grasp_planner.batch import GraspCase, load_table, run_batch
    from grasp_planner.batch.simulations import simulate_run
    from grasp_planner.simulate import find_protocol

    settings = {"contact_set": "sphere", "enough": 1}
    cases = [GraspCase(object="cylinder:radius=0.036", n_synergies=15, seed=k, settings=settings) for k in (0, 1)]
    run_batch(cases, tmp_path / "run", workers=1)
    done = invoke("--run", tmp_path / "run", "--geometry", "contacts", "--squeeze", 2, "--no-ladder", "--workers", 1)
    assert done.exit_code in (0, 3), done.output
    folder = tmp_path / "run" / "simulation-plan"
    rows = load_table(folder).to_pylist()
    assert [row["grasp_row"] for row in rows] == [0, 1]
    assert [row["status"] for row in rows] == ["done", "done"]
    assert rows[0]["passed"]
    assert json.loads(rows[0]["record"])["squeeze"] == 2.0
    protocol = replace(find_protocol("plan"), geometry="contacts")
    again = simulate_run(tmp_path / "run", None, protocol, squeeze=2.0, ladder=False, workers=1)
    assert (again.done, again.resumed) == (2, 2)
    with pytest.raises(gp.GraspPlannerError, match="other cases"):
        simulate_run(tmp_path / "run", None, protocol, squeeze=1.0, ladder=False, workers=1)


@pytest.mark.slow
def test_the_animation_is_one_file(held, tips_only, tmp_path):
    from grasp_planner.viewer import export_simulation_html

    quick = replace(tips_only, hold_s=0.2, torques=False, rest_s=0.2)
    with pytest.raises(gp.InvalidValueError, match="recorded"):
        export_simulation_html(simulate_grasp(held, quick, ladder=False), tmp_path / "no.html")
    found = simulate_grasp(held, quick, squeeze=2.0, ladder=False, record=True)
    assert len(found.frames) > 6 * 25
    assert all(later.time > earlier.time for earlier, later in zip(found.frames[1:], found.frames[2:], strict=False))
    export_simulation_html(found, tmp_path / "yes.html")
    page = (tmp_path / "yes.html").read_text(encoding="utf-8")
    assert "6 of 6 force directions held" in page


def test_on_its_table_it_is_lifted_and_shaken_and_a_plan_without_one_is_not_simulated(planned, tmp_path):
    page = tmp_path / "table.html"
    done = invoke(FOLDER / "ground.json", "--protocol", "table", "--html", page)
    assert done.exit_code == 0, done.output
    assert "passed: lifted 10 cm, 3 of 3 shakes of 5 m/s² held" in done.output
    assert "mm with the table" in " ".join(done.output.split())
    assert "at 5 m/s²" in page.read_text(encoding="utf-8")
    path = tmp_path / "planned.json"
    path.write_text(grasp_json(planned), encoding="utf-8")
    done = invoke(path, "--protocol", "table")
    assert done.exit_code == 3
    assert "not simulated: the hand would go through the table" in " ".join(done.output.split())
