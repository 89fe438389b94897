"""Tests of reduced scenarios: removed parts, rounded numbers, and the written text."""

from typing import Any

import pytest

from simscen.loading.reduction import (
    changed_values,
    find_roundings,
    removable_parts,
    removed_parts,
    with_roundings,
    with_seed,
    with_values,
    without_parts,
)
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode, Position, ScalarNode
from simscen.loading.yaml.writing import changed_text

TEXT = """\
# What this tests.
simscen: 1
world: house.world.yaml

robot: {pose: dock, motor_torque: 93.1234 %}
goals:
  # the first
  - {pose: sofa, timeout: 61.7 s}
  - pose: kitchen  # the second
    timeout: 100 s
# disturbances
events:
  - {name: crate, when: {time: 30 s}, do: {remove: box}}
pass:
  - collisions: {max: 0}
"""


def parsed(text: str) -> MappingNode:
    tree, problems = parse_yaml(text, "a.yaml")
    assert not problems
    assert isinstance(tree, MappingNode)
    return tree


def test_parts_of_any_depth_are_removable_except_the_cause_of_failure() -> None:
    tree = parsed(TEXT)
    assert removable_parts(tree, 1) == [("goals",), ("events",)]
    assert ("goals", 0) in removable_parts(tree, 2)
    assert ("robot", "motor_torque") in removable_parts(tree, 2)
    assert not any(keys[0] in ("pass", "simscen") for depth in (1, 2, 3) for keys in removable_parts(tree, depth))


def test_removing_parts_also_removes_empty_parents() -> None:
    tree = parsed(TEXT)
    reduced = without_parts(tree, [("goals", 0), ("events", 0), ("robot", "motor_torque")])
    assert reduced.plain["goals"] == [{"pose": "kitchen", "timeout": "100 s"}]
    assert "events" not in reduced.plain
    assert reduced.plain["robot"] == {"pose": "dock"}
    assert removed_parts(tree, reduced) == ["robot.motor_torque", "goals[0] (sofa)", "events"]


def test_values_are_changed_at_their_keys() -> None:
    tree = parsed(TEXT)
    position = Position("a.yaml", 1, 1)
    changed = with_values(tree, {("goals", 1, "timeout"): ScalarNode(position, "5 s"), ("robot", "motor_torque"): None})
    assert changed.plain["goals"][1] == {"pose": "kitchen", "timeout": "5 s"}
    assert changed.plain["robot"] == {"pose": "dock"}
    assert with_values(tree, {("stack", "type"): ScalarNode(position, "x")}).plain["stack"] == {"type": "x"}
    assert with_seed(tree, 7).plain["seed"] == 7


@pytest.mark.parametrize(("digits", "values"), [(1, {"90 %", "60 s"}), (2, {"93 %", "62 s"}), (3, {"93.1 %"})])
def test_numbers_are_rounded_with_their_units(digits: int, values: set[str]) -> None:
    tree = parsed(TEXT)
    roundings = find_roundings(tree, digits)
    assert {rounding.value for rounding in roundings} == values
    rounded = with_roundings(tree, roundings)
    assert len(changed_values(tree, rounded)) == len(values)
    assert not removed_parts(tree, rounded)


def text_with_content(content: dict[str, Any]) -> str:
    text = changed_text(TEXT, "a.yaml", content)
    assert parsed(text).plain == content
    return text


def test_unchanged_parts_keep_their_text() -> None:
    content = parsed(TEXT).plain
    assert text_with_content(content) == TEXT.replace("\n\n", "\n")
    without_second = {**content, "goals": content["goals"][:1]}
    assert "  # the first\n  - {pose: sofa, timeout: 61.7 s}\n# disturbances\n" in text_with_content(without_second)
    without_first = {**content, "goals": content["goals"][1:]}
    assert "goals:\n  - pose: kitchen  # the second\n    timeout: 100 s\n# disturbances\n" in text_with_content(
        without_first
    )
    changed = {**content, "robot": {"pose": "sofa"}, "seed": 3}
    assert "robot: {pose: sofa}\n" in text_with_content(changed)
    assert text_with_content(changed).endswith("pass:\n  - collisions: {max: 0}\nseed: 3\n")
    assert (
        text_with_content({key: value for key, value in content.items() if key != "events"}).count("disturbances") == 0
    )


@pytest.mark.parametrize(
    "text",
    [
        "{simscen: 1, goals: [{pose: a}, {pose: b}]}",
        "simscen: 1\ngoals: [{pose: a}, {pose: b}]\n",
        "simscen: 1\ngoals:\n- &one\n  pose: a\n- *one\n",
        "simscen: 1\ngoals:\n- {pose: a}\n-\n  pose: b\nnote: |\n  - one\n  # two\n",
    ],
)
def test_any_layout_is_written_with_the_right_content(text: str) -> None:
    content = parsed(text).plain
    for changed in (content, {**content, "goals": content["goals"][1:]}, {**content, "goals": [{"pose": "c"}]}):
        assert parsed(changed_text(text, "a.yaml", changed, "a comment\nof two lines")).plain == changed


def test_names_that_begin_with_a_number_are_not_rounded() -> None:
    tree, _ = parse_yaml("{events: [{name: 2024-11 pallet}], robot: {payload: {mass: 12345 g}}}", "a")
    assert isinstance(tree, MappingNode)
    assert [rounding.value for rounding in find_roundings(tree, 3)] == ["12300 g"]
