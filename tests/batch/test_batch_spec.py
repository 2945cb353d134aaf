"""Specifications: what they expand to, and what every mistake is answered with."""

import re
from dataclasses import replace

import numpy as np
import pytest

from grasp_planner.batch import CaseTable, GraspCase, ResultsError, SpecError, parse_spec, read_spec
from grasp_planner.batch import expand as expand_module
from grasp_planner.batch import spec as spec_module
from grasp_planner.batch.expand import cases_hash


def expand(data):
    return list(CaseTable(parse_spec(data)))


def test_product_is_every_value_with_every_other():
    cases = expand({"blocks": [{"product": {"n_synergies": [3, 5], "seed": {"from": 0, "to": 2}}}]})
    assert [(c.n_synergies, c.seed) for c in cases] == [(3, 0), (3, 1), (3, 2), (5, 0), (5, 1), (5, 2)]


def test_zip_varies_together_within_the_product():
    block = {"product": {"seed": [0, 1]}, "zip": {"force_weight": [1e-6, 1.0], "task_weight": [1, 0]}}
    cases = expand({"blocks": [block]})
    assert [(c.seed, c.settings["force_weight"], c.settings["task_weight"]) for c in cases] == [
        (0, 1e-6, 1),
        (0, 1.0, 0),
        (1, 1e-6, 1),
        (1, 1.0, 0),
    ]


def test_blocks_follow_one_another_and_cases_are_made_when_asked_for():
    table = CaseTable(parse_spec({"blocks": [{"product": {"seed": {"from": 0, "to": 99_999}}}, {}]}))
    assert len(table) == 100_001
    assert table[99_999].seed == 99_999 and table[-1].seed == 0
    with pytest.raises(IndexError):
        table[100_001]


@pytest.mark.parametrize(
    ("axis", "values"),
    [
        ({"from": 0.02, "to": 0.03, "step": 0.0025}, [0.02, 0.0225, 0.025, 0.0275, 0.03]),
        ({"from": 0.02, "to": 0.04, "count": 3}, [0.02, 0.03, 0.04]),
        ({"from": 0.01, "to": 1, "count": 3, "spacing": "log"}, [0.01, 0.1, 1.0]),
    ],
)
def test_ranges_include_both_ends(axis, values):
    assert [c.settings["friction"] for c in expand({"blocks": [{"product": {"friction": axis}}]})] == values


def test_samples_are_seeded_and_independent_of_other_axes():
    axis = {"uniform": [0.3, 0.9], "count": 20}
    draw = [c.settings["friction"] for c in expand({"seed": 4, "blocks": [{"product": {"friction": axis}}]})]
    both = {"friction": axis, "n_synergies": {"choice": [3, 5], "count": 20}}
    again = [c.settings["friction"] for c in expand({"seed": 4, "blocks": [{"zip": both}]})]
    other = [c.settings["friction"] for c in expand({"seed": 5, "blocks": [{"product": {"friction": axis}}]})]
    assert draw == again != other
    assert len(set(draw)) == 20 and 0.3 <= min(draw) <= max(draw) <= 0.9


@pytest.mark.parametrize(
    "axis",
    [{"loguniform": [0.1, 1], "count": 9}, {"normal": [0.5, 0.01], "count": 9}, {"choice": [0.5, 1], "count": 9}],
)
def test_every_kind_of_sample(axis):
    values = [c.settings["friction"] for c in expand({"blocks": [{"product": {"friction": axis}}]})]
    assert len(values) == 9 and all(0.09 < value < 1.01 for value in values)


def test_whole_number_samples_include_both_ends():
    cases = expand({"blocks": [{"product": {"seed": {"integers": [1, 3], "count": 60}}}]})
    assert {c.seed for c in cases} == {1, 2, 3}


def test_object_sizes_add_to_the_text_form():
    (case,) = expand({"defaults": {"object": "cylinder:height=0.2"}, "blocks": [{"fixed": {"object.radius": 0.025}}]})
    assert case.object.startswith("cylinder:") and "radius=0.025" in case.object and "height=0.2" in case.object


def test_overrides_apply_where_they_match():
    data = {
        "blocks": [{"product": {"object.radius": [0.02, 0.04], "n_synergies": [3, 5, 15]}}],
        "overrides": [
            {"where": {"n_synergies": [5, 15], "object.radius": 0.04}, "set": {"time_limit_s": 300, "starts": 9}}
        ],
    }
    limits = [(c.time_limit_s, c.settings.get("starts")) for c in expand(data)]
    assert limits == [(120, None)] * 4 + [(300, 9)] * 2


def test_several_tasks_in_one_case():
    cases = expand({"blocks": [{"product": {"task": ["force:+x", ["force:+y", "torque:+z*0.5"]]}}]})
    assert [c.task for c in cases] == [("force:+x",), ("force:+y", "torque:+z*0.5")]


def test_hash_depends_on_the_cases_and_not_on_how_they_are_written():
    first = CaseTable(parse_spec({"blocks": [{"product": {"seed": [0, 1]}}]}))
    second = CaseTable(parse_spec({"description": "x", "blocks": [{"fixed": {"seed": 0}}, {"zip": {"seed": [1]}}]}))
    third = CaseTable(parse_spec({"blocks": [{"product": {"seed": [0, 2]}}]}))
    assert cases_hash(first, "p") == cases_hash(second, "p")
    assert len({cases_hash(first, "p"), cases_hash(third, "p"), cases_hash(first, "q")}) == 3


ERRORS = [
    ("blocks: []", "blocks", "[]", "at least 1 item"),
    ("block: [{}]", "block", "'block'", "did you mean 'blocks'? one of"),
    ("seed: 1", "blocks", "None", "required"),
    ("seed: x\nblocks: [{}]", "seed", "'x'", "integer"),
    ("blocks:\n  - products: {}", "blocks[0].products", "'products'", "did you mean 'product'?"),
    ("blocks:\n  - product: {frction: [1]}", "blocks[0].product.frction", "'frction'", "did you mean 'friction'?"),
    ("blocks:\n  - product: {friction: [0.5, -1]}", "blocks[0].product.friction[1]", "-1", "a finite number > 0"),
    ("blocks:\n  - product: {friction: [1, a]}", "blocks[0].product.friction[1]", "'a'", "a finite number > 0"),
    ("blocks:\n  - product: {friction: []}", "blocks[0].product.friction", "[]", "at least one value"),
    ("blocks:\n  - product: {seed: {frm: 1}}", "blocks[0].product.seed", "{'frm': 1}", "{from, to, step}"),
    ("blocks:\n  - product: {seed: {from: 1, too: 2}}", "blocks[0].product.seed.too", "'too'", "did you mean 'to'?"),
    ("blocks:\n  - product: {friction: {from: 0.5, to: 2}}", "blocks[0].product.friction", "", "a step or a count"),
    ("blocks:\n  - product: {seed: {from: 5, to: 1}}", "blocks[0].product.seed", "", "'to' not below 'from'"),
    (
        "blocks:\n  - product: {friction: {uniform: [1], count: 3}}",
        "blocks[0].product.friction.uniform",
        "[1]|(1",
        "[low, high]",
    ),
    ("blocks:\n  - product: {friction: {uniform: [1, 2], count: 0}}", "blocks[0].product.friction.count", "0", ""),
    ("blocks:\n  - zip: {seed: [1, 2], friction: [1]}", "blocks[0].zip", "{'seed': 2, 'friction': 1}", "equal length"),
    ("blocks:\n  - fixed: {seed: 1}\n    product: {seed: [1]}", "blocks[0].product.seed", "'seed'", "given once"),
    ("defaults: {hand: dlr_hit_ii_rigt}\nblocks: [{}]", "defaults.hand", "'dlr_hit_ii_rigt'", "dlr_hit_ii_right"),
    ("blocks:\n  - fixed: {task: 'force:q'}", "blocks[0].fixed.task", "'force:q'", ""),
    ("blocks:\n  - fixed: {task: []}", "blocks[0].fixed.task", "[]", "at least 1 item"),
    ("blocks:\n  - fixed: {n_synergies: 2.5}", "blocks[0].fixed.n_synergies", "2.5", "integer"),
    ("blocks:\n  - fixed: {n_synergies: 99}", "blocks[0].fixed.n_synergies", "99", "a whole number from 1 to 15"),
    ("blocks:\n  - fixed: {object.radius: -0.1}", "blocks[0].fixed.object.radius", "-0.1", "a finite number > 0"),
    ("blocks:\n  - fixed: {object: cylindr}", "blocks[0].fixed.object", "'cylindr'", "did you mean 'cylinder'"),
    ("blocks:\n  - product: {object.colour: [1]}", "blocks[0].product.object.colour", "1", "radius"),
    ("blocks:\n  - fixed: {time_limit_s: 0}", "blocks[0].fixed.time_limit_s", "0", "greater than 0"),
    ("blocks:\n  - fixed: {starts: 0}", "blocks[0].fixed.starts", "0", "a whole number >= 1"),
    ("blocks: [{}]\noverrides: [{where: {seed: 1}}]", "overrides[0].set", "None", "required"),
    ("blocks: [{}]\noverrides: [{where: {sed: 1}, set: {seed: 2}}]", "overrides[0].where.sed", "'sed'", "'seed'"),
    ("blocks: [{}]\nblocks: [{}]", "blocks", "'blocks'", "a key given once"),
    ("- 1", "specification", "[1]", "a mapping"),
]


@pytest.mark.parametrize(("text", "where", "value", "allowed"), ERRORS)
def test_every_error_names_path_value_and_what_is_allowed(write_spec, text, where, value, allowed):
    path = write_spec(text)
    with pytest.raises(SpecError) as caught:
        CaseTable(read_spec(path)).check()
    error = caught.value
    assert (error.where or "specification") == where
    assert any(option in repr(error.value) for option in value.split("|")), error.value
    assert allowed in error.allowed
    message = str(error)
    assert message.startswith(f"{path}: {where}") and "allowed:" in message
    assert error.line is not None and f"(line {error.line})" in message


def test_errors_give_the_line(write_spec):
    path = write_spec(
        "seed: 1\nblocks:\n  - fixed: {}\n  - product:\n      seed: [1]\n      friction: [1,\n        -2]\n"
    )
    with pytest.raises(SpecError, match=r"blocks\[1\].product.friction\[1\] \(line 7\)"):
        read_spec(path)


@pytest.mark.parametrize(
    ("data", "reason"),
    [(b"a: [1", "line 1"), (b"\xff\xfe\x00", "UTF-8|not valid"), (b"a: !!python/name:os.system x", "constructor")],
)
def test_files_that_are_no_yaml(tmp_path, data, reason):
    path = tmp_path / "spec.yaml"
    path.write_bytes(data)
    with pytest.raises(ResultsError, match=reason):
        read_spec(path)


def test_missing_file(tmp_path):
    with pytest.raises(ResultsError, match="No such file"):
        read_spec(tmp_path / "none.yaml")


def test_numbers_without_a_dot_are_numbers(write_spec):
    (case,) = CaseTable(read_spec(write_spec("blocks:\n  - fixed: {force_weight: 1e-6}")))
    assert case.settings["force_weight"] == 1e-6


def test_errors_survive_pickling(write_spec):
    import pickle

    error = SpecError(None, "a[0]", 1, "2", 3)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_case_makes_its_problem():
    from grasp_planner import load_hand

    (case,) = expand({"blocks": [{"fixed": {"friction": 0.5, "gravity": [0, 0, -1], "starts": 2, "n_synergies": 5}}]})
    problem = case.problem(load_hand(case.hand))
    assert problem.parameters.friction == 0.5 and problem.n_synergies == 5 and case.options().starts == 2
    np.testing.assert_array_equal(problem.parameters.gravity, [0, 0, -1])


def test_groups_of_options_are_set_one_by_one():
    from grasp_planner import ClearanceOptions, load_hand

    fixed = {"clearance": True, "clearance.margin": 0.002}
    (case,) = expand({"blocks": [{"fixed": fixed}]})
    options = case.problem(load_hand(case.hand)).clearance
    assert options == replace(ClearanceOptions(), margin=0.002) != ClearanceOptions()
    assert case.columns(load_hand(case.hand))["clearance_margin"] == 0.002
    for key, value in (("clearance", "on"), ("clearance.margin", -1), ("clearance.marign", 1)):
        with pytest.raises(SpecError, match=re.escape(f"blocks[0].fixed.{key}")):
            parse_spec({"blocks": [{"fixed": {key: value}}]})


@pytest.mark.parametrize(
    ("key", "axis", "value"),
    [
        ("friction", {"from": 0.5, "to": 12.0, "count": 200_000}, "12.0"),
        ("seed", [-1, *range(20_000)], "-1"),
        ("friction", [0.5, float("nan"), *(0.5 + 1e-6 * i for i in range(20_000))], "nan"),
        ("hand", {"choice": ["dlr_hit_ii_right", "none"], "count": 20_000}, "'none'"),
        ("n_synergies", [*range(1, 6000), 1.5], "1.5"),
    ],
)
def test_wrong_values_of_long_axes_are_found_without_trying_each(key, axis, value, monkeypatch):
    tried, check = [], spec_module.check_value

    def counted(*arguments):
        tried.append(arguments)
        check(*arguments)

    monkeypatch.setattr(spec_module, "check_value", counted)
    with pytest.raises(SpecError, match=rf"product\.{key}.*got {value}"):
        parse_spec({"blocks": [{"product": {key: axis}}]})
    assert len(tried) < 10


def test_of_very_many_cases_a_sample_is_checked(monkeypatch):
    made, make = [], GraspCase.problem

    def counted(case, hand):
        made.append(case)
        return make(case, hand)

    monkeypatch.setattr(GraspCase, "problem", counted)
    monkeypatch.setattr(expand_module, "MAX_CHECKED_ROWS", 50)
    monkeypatch.setattr(expand_module, "MAX_CHECKED_PROBLEMS", 8)
    friction = {"from": 0.5, "to": 0.9, "count": 1000}
    CaseTable(parse_spec({"blocks": [{"product": {"friction": friction, "seed": [0, 1]}}]})).check()
    assert len(made) == 8
    CaseTable(parse_spec({"blocks": [{"product": {"friction": [0.5, 0.6], "seed": {"from": 0, "to": 999}}}]})).check()
    assert len(made) == 10
