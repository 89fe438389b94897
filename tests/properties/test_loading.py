"""Property tests of loading: any file gives a scenario or problems with positions inside the file."""

from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from simscen.cli.diagnostics import as_text
from simscen.core.errors import Problem, UsageError
from simscen.loading.keywords import keyword_matcher
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.parser import parse_yaml
from simscen.report.display_text import escape_control
from tests.scenario_files import try_scenario

SCENARIO = """\
simscen: 1
name: all of it
tags: [smoke]
seed: 7
world:
  simscen: 1
  walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  objects: [{name: cart, box: [0.5, 0.5, 1], pose: {x: 3, y: 2}}]
  places: {start: {x: 1, y: 1}, desk: {x: 5, y: 3, yaw: 90 deg}}
  regions: {hall: [[0, 0], [2, 0], [2, 4]]}
robot: {model: turtlebot, pose: start, initial_estimate: {x: 1, y: 1, std: [0.1, 0.1, 0.1]}}
stack: {localizer: {type: amcl, alpha1: 0.1}, controller: {type: dwb, sim_time: 1 s}}
goals: [{pose: desk, timeout: 60 s}, {pose: {x: 1, y: 3}}]
events:
  - name: push
    when: {any: [{time: 10 s}, {robot_in: {region: hall}}], delay: 1 s}
    do: [{move: {name: cart, through: [[4, 1]], speed: 1}}, {cancel_goal: {}}]
faults: [{sensor: lidar, off: {}, when: {travelled: 1 m}, for: 2 s}]
pass: [{goals_reached: {}}, {stopped_within: {time: 1, after: lidar.off}, severity: warn}]
"""
TREE = parse_yaml(SCENARIO, "f")[0]
assert TREE is not None
PLAIN: Any = TREE.plain

QUICK = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture
def load(tmp_path: Path) -> Any:
    """Return a function that loads a text or bytes. The result is a scenario, or problems with valid positions."""
    path = tmp_path / "a.scenario.yaml"

    def load_content(content: str | bytes) -> LoadedScenario | list[Problem]:
        raw = content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content
        path.write_bytes(raw)
        result = try_scenario(path, tmp_path)
        if isinstance(result, list):
            assert result, "neither a scenario nor a problem"
            _assert_positions_inside(result, raw)
        return result

    return load_content


def _assert_positions_inside(problems: list[Problem], raw: bytes) -> None:
    lines = raw.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for problem in problems:
        if problem.line:
            assert 1 <= problem.line <= len(lines)
            assert 1 <= problem.col <= len(lines[problem.line - 1]) + 1
    assert escape_control(expected := as_text(problems)) == expected


def test_unchanged_scenario_is_valid(load: Any) -> None:
    assert isinstance(load(SCENARIO), LoadedScenario)


@QUICK
@given(st.binary(max_size=400))
def test_any_bytes_are_loaded_or_refused(load: Any, raw: bytes) -> None:
    load(raw)


@QUICK
@given(st.text(st.sampled_from("abc:-[]{}\"'#&*!|>%@`?, \n\t1.eE~<\\é机"), max_size=200))
def test_any_yaml_characters_are_loaded_or_refused(load: Any, text: str) -> None:
    load(text)


@QUICK
@given(
    st.integers(0, len(SCENARIO)), st.integers(0, 40), st.text(st.sampled_from(":-[]{}\"'#&*!\n \tx1~\0é"), max_size=5)
)
def test_scenario_with_any_edit_is_loaded_or_refused(load: Any, start: int, length: int, insertion: str) -> None:
    load(SCENARIO[:start] + insertion + SCENARIO[start + length :])


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=10)
    | st.sampled_from(["5 s", "desk", "1 m", "cart"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)


def _paths(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    children = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [path, *(found for key, value in children for found in _paths(value, (*path, key)))]


PATHS = _paths(PLAIN)[1:]


@QUICK
@given(st.sampled_from(PATHS), JSON)
def test_scenario_with_any_value_is_loaded_or_refused(load: Any, path: tuple[Any, ...], value: Any) -> None:
    changed = deepcopy(PLAIN)
    parent = changed
    for key in path[:-1]:
        parent = parent[key]
    parent[path[-1]] = value
    load(yaml.safe_dump(changed, allow_unicode=True))


def _node_at(path: tuple[Any, ...]) -> Any:
    node = PLAIN
    for key in path:
        node = node[key]
    return node


MAPPINGS = [path for path in PATHS if isinstance(_node_at(path), dict) and path[-1] not in ("places", "regions")]
"""Paths of the mappings in which an unknown key is an error."""


@QUICK
@given(st.sampled_from(MAPPINGS), st.text("abcdefghijklmnopqrstuvwxyz_", min_size=1, max_size=12))
def test_unknown_key_is_reported_at_its_position(load: Any, path: tuple[Any, ...], key: str) -> None:
    changed = deepcopy(PLAIN)
    parent = changed
    for part in path:
        parent = parent[part]
    parent[f"{key}_zz"] = 1
    problems = load(yaml.safe_dump(changed))
    assert isinstance(problems, list)
    assert any(
        p.code == "SC012" and f"`{key}_zz`" in p.message and p.source[p.col - 1 :].startswith(f"{key}_zz")
        for p in problems
    )


@QUICK
@given(st.text(max_size=60))
def test_any_keyword_expression_is_read_or_refused(text: str) -> None:
    with suppress(UsageError):
        keyword_matcher(text)("faults/lidar_off")
