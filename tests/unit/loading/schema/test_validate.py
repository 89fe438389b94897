"""Positions and hints of single mistakes; whole files are in tests/diagnostics."""

import pytest
from pydantic import BaseModel

from simscen.core.errors import Problem
from simscen.loading.schema import common_mistakes
from simscen.loading.schema.validate import check
from simscen.loading.yaml.parser import parse_yaml
from simscen.model.robot import RobotSpec
from simscen.model.scenario import ScenarioSpec
from simscen.model.world import RosMapSpec, WorldSpec

LIMITS = "limits: {linear: 1, angular: 1, linear_acceleration: 1, angular_acceleration: 1}\n"
SCENARIO = "simscen: 1\nworld: w\nrobot: {pose: p}\npass: [{goals_reached: {}}]\n"


def _problems(model: type[BaseModel], text: str) -> list[Problem]:
    tree, problems = parse_yaml(text, "f")
    assert tree is not None
    assert not problems
    found = check(model, tree)
    return found if isinstance(found, list) else []


def _positions_and_messages(model: type[BaseModel], text: str) -> list[tuple[int, int, str]]:
    return [(p.line, p.col, p.message) for p in _problems(model, text)]


def test_a_file_of_another_kind_does_not_take_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search for the right place of each key once took 40 ms, minutes for a large file."""
    calls = []
    found = common_mistakes.models_at
    common_mistakes._mappings_below.cache_clear()
    monkeypatch.setattr(common_mistakes, "models_at", lambda *where: (calls.append(where), found(*where))[1])
    one = _problems(ScenarioSpec, SCENARIO + "zzz: 1\n")
    first = len(calls)
    many = _problems(ScenarioSpec, SCENARIO + "".join(f"zzz{number}: 1\n" for number in range(200)))
    assert (len(one), len(many)) == (1, 200)
    assert len(calls) - first < first + 200 * 4


@pytest.mark.parametrize("place", ["robot: {pose: {x: TEXT}}", "pass: TEXT", "time_limit: TEXT"])
def test_a_long_text_is_shortened_in_messages(place: str) -> None:
    text = "simscen: 1\nworld: w\n" + place.replace("TEXT", "x" * 10_000) + "\n"
    assert all(len(problem.message) < 200 and len(problem.hint) < 400 for problem in _problems(ScenarioSpec, text))


def test_a_valid_scenario_becomes_its_model() -> None:
    tree, _ = parse_yaml(SCENARIO + "faults: [{sensor: lidar, off: {}, for: 3 s}]\n", "f")
    assert tree is not None
    spec = check(ScenarioSpec, tree)
    assert isinstance(spec, ScenarioSpec)
    assert spec.faults[0].for_ == 3.0


@pytest.mark.parametrize(
    ("value", "bound"), [("600 mm/h", "500 mm/h"), ("1 m/h", "0.5 m/h"), ("0.1", "0.0001388888888888889")]
)
def test_a_bound_has_the_unit_of_the_value_and_is_not_rounded(value: str, bound: str) -> None:
    expected = _positions_and_messages(
        ScenarioSpec, SCENARIO + f"faults: [{{sensor: lidar, rain: {{rate: {value}}}}}]\n"
    )
    assert expected == [(5, 39, f"must be at most {bound}, got `{value}`")]


def test_a_bound_of_a_ratio_in_percent_is_in_percent() -> None:
    expected = _positions_and_messages(
        ScenarioSpec, SCENARIO + "faults: [{sensor: lidar, rain: {rate: 1 mm/h, reflectivity: 150 %}}]\n"
    )
    assert expected == [(5, 61, "must be at most 100 %, got `150 %`")]


def test_names_of_fields_in_python_are_no_keys() -> None:
    expected = _positions_and_messages(ScenarioSpec, SCENARIO + "faults: [{sensor: lidar, off: {}, for_: 3 s}]\n")
    assert expected == [(5, 35, "unknown key `for_` in `faults[0]`")]


def test_mistake_in_a_union_member_is_reported_for_that_member() -> None:
    text = SCENARIO + "events:\n  - when: {time: 1}\n    do:\n      - {remove: {name: a}}\n      - {remove: {nam: b}}\n"
    assert _positions_and_messages(ScenarioSpec, text) == [(9, 19, "unknown key `nam` in `events[0].do[1].remove`")]


def test_type_is_optional_if_there_is_a_default() -> None:
    assert _positions_and_messages(ScenarioSpec, SCENARIO + "stack: {controller: {lookahead_dist: 1}}\n") == []
    expected = _positions_and_messages(ScenarioSpec, SCENARIO + "stack: {controller: {sim_time: 1}}\n")
    assert expected == [(5, 22, "unknown key `sim_time` in `stack.controller`")]


def test_a_key_of_another_type_names_that_type() -> None:
    problem = _problems(ScenarioSpec, SCENARIO + "stack: {localizer: {type: amcl, match_scans: true}}\n")[0]
    assert problem.message == "unknown key `match_scans` in `stack.localizer`"
    assert "`scan_matching_amcl`" in problem.hint


def test_a_missing_type_lists_the_types() -> None:
    problem = _problems(
        RobotSpec,
        "simscen: 1\nname: r\nurdf: a\nsensors: {}\ndrive: {wheel_radius: 1}\n" + LIMITS,
    )[0]
    assert problem.message == "missing key `type` in `drive`"
    assert problem.hint == "expected one of: differential, skid_steer, ackermann, omnidirectional, mecanum"


def test_a_mapping_may_be_expected_where_a_type_would_tell_which() -> None:
    expected = _positions_and_messages(ScenarioSpec, SCENARIO + "stack: {localizer: amcl}\n")
    assert expected == [(5, 20, "expected a mapping, got the text `amcl`")]


def test_keys_of_names_are_checked_at_the_key() -> None:
    expected = _positions_and_messages(WorldSpec, "simscen: 1\nplaces:\n  ok: {x: 1, y: 2}\n  no/t: {x: 1, y: 2}\n")
    assert expected == [(4, 3, "`no/t` is not a valid name")]


def test_a_member_of_a_plain_union_is_reported_once() -> None:
    expected = _positions_and_messages(RosMapSpec, "image: a\nresolution: 1\norigin: [0, 0, 0]\nnegate: maybe\n")
    assert len(expected) == 1
    assert expected[0][:2] == (4, 9)


def test_null_values_are_refused() -> None:
    text = SCENARIO + "name: ~\nmap: null\ngoals:\nfaults: [{sensor: lidar, off: }]\ntags: [a, ~]\n"
    expected = _problems(ScenarioSpec, text)
    assert [(p.line, p.code) for p in expected] == [
        (5, "SC018"),
        (6, "SC018"),
        (7, "SC018"),
        (8, "SC018"),
        (9, "SC018"),
    ]
    assert expected[3].hint == "write `off: {}`"


def test_unsupported_version_is_the_only_reported_problem() -> None:
    assert _positions_and_messages(ScenarioSpec, "simscen: 2\nnonsense: 1\n") == [
        (1, 10, "written for language version 2; this simscen supports 1")
    ]


def test_a_number_in_quotes_is_no_choice() -> None:
    problem = _problems(ScenarioSpec, SCENARIO.replace("simscen: 1", "simscen: '1'"))[0]
    assert (problem.line, problem.col, problem.hint) == (1, 10, "remove the quotes")


def test_a_tuple_is_called_a_list() -> None:
    estimate = "robot: {pose: {x: 1, y: 1}, initial_estimate: {x: 1, y: 1, std: 0.5}}\n"
    text = "".join(estimate if line.startswith("robot") else line for line in SCENARIO.splitlines(keepends=True))
    assert [message for *_, message in _positions_and_messages(ScenarioSpec, text)] == [
        "expected a list, got the number 0.5"
    ]


def test_control_characters_by_escape_are_refused_in_names() -> None:
    expected = _positions_and_messages(ScenarioSpec, SCENARIO + 'name: "\\x1b[31mred"\n')
    assert expected == [(5, 7, "control character U+001B in `\\x1b[31mred`")]


def test_a_choice_without_a_key_lists_the_keys() -> None:
    problem = _problems(ScenarioSpec, SCENARIO.replace("[{goals_reached: {}}]", "[{severity: warn}]"))[0]
    assert (problem.line, problem.col, problem.message) == (4, 8, "a key is missing here")
    assert problem.hint.startswith("expected one of: goals_reached, ")


def test_a_bare_value_is_as_strict_as_any_other() -> None:
    for written in ("true", "'5'", ".nan", "-1 s", "3 m"):
        text = SCENARIO + f"events: [{{when: {{time: {written}}}, do: {{cancel_goal: {{}}}}}}]\n"
        assert [(line, col) for line, col, _ in _positions_and_messages(ScenarioSpec, text)] == [(5, 24)], written
