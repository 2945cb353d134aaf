"""The wide search: counts are those of phase one, and every column holds what it says."""

import re

import numpy as np

import grasp_planner as gp
from grasp_planner.multistart.problem_rows import BatchedProblem
from grasp_planner.planning.pooled_starts import pressing_states
from grasp_planner.planning.starts import random_start

from .scripts import load_script


def test_columns_hold_what_they_say(right):
    script = load_script("search_widely")
    rows = {}
    for name, (clearance, loads) in script.HELD.items():
        problem = gp.GraspProblem(right, gp.Sphere(0.035), clearance=clearance, loads=loads)
        batched = BatchedProblem(problem)
        states = pressing_states(batched, [random_start(problem, np.random.default_rng(0))])
        rows[name] = {row.name for row in batched.rows(states)}
    more = {name: held - rows["nothing"] for name, held in rows.items()}
    assert more["tips"] == {"tip_patch"}
    assert more["links and object"] == {"link_object"}
    assert more["links and links"] == {"self_collision"}
    assert more["loads"] and all(name.startswith("load_") for name in more["loads"])
    assert more["order (Remark 1)"] == {"abduction_order"}
    assert set().union(*more.values()) <= more["all"]
    for name, (clearance, loads) in script.LEFT_OUT.items():
        left = script.HELD[name]
        off, on = (script.PLAIN, script.NO_LOADS), (script.ALL, gp.LoadCases())
        changed = [
            field
            for field in ("link_object", "self_collision", "tip_patch", "remark1")
            if getattr(clearance, field) != getattr(on[0], field)
        ]
        assert changed == [
            field
            for field in ("link_object", "self_collision", "tip_patch", "remark1")
            if getattr(left[0], field) != getattr(off[0], field)
        ]
        assert loads.active == (name != "loads")


def test_it_prints_what_it_found(monkeypatch, capsys):
    script = load_script("search_widely")
    arguments = [
        "--objects",
        "cylinder:radius=0.03",
        "--synergy-set",
        "native_clear",
        "--counts",
        "15",
        "--starts",
        "12",
    ]
    monkeypatch.setattr("sys.argv", ["search_widely.py", *arguments])
    script.main()
    row = capsys.readouterr().out.splitlines()[-1]
    found = [int(count) for count in re.findall(r"(\d+)/12", row)]
    assert len(found) == len(script.HELD)
    assert max(found) > 0
