"""Tests that an edit changes only the text of one value."""

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from simscen.editor.map_view.map_edits import read_edits
from simscen.editor.map_view.map_objects import number
from simscen.editor.text_editing.splices import EditRefused
from simscen.editor.text_editing.text_edits import AddItem, Edit, RemovePart, SetValue, apply_edits
from simscen.editor.text_editing.value_text import is_same_value
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.source_nodes import parse_source, source_at
from simscen.loading.yaml.tree import Key
from simscen.spec.quantities import si_number

ROOT = Path(__file__).parents[3]
SHIPPED = sorted([*ROOT.glob("scenarios/**/*.yaml"), *ROOT.glob("worlds/*.world.yaml")])


def apply(text: str, *edits: Edit) -> str:
    return apply_edits(text, edits)


def plain(text: str) -> Any:
    """Return the YAML as simscen reads it, as dicts and lists."""
    tree, problems = parse_yaml(text, "")
    assert tree is not None and not problems
    return tree.plain


@pytest.mark.parametrize(
    ("before", "value", "after"),
    [
        ("x: 1.0", 2, "x: 2.0"),
        ("x: 1.50", 2.25, "x: 2.25"),
        ("x: 1", 2.5, "x: 2.5"),
        ("x: 1.123456", 2, "x: 2.000"),
        ("x: 250 cm", 3.1, "x: 310 cm"),
        ("x: 2.5m", 3, "x: 3.0m"),
        ("x: 90 deg", math.pi, "x: 180 deg"),
        ('x: "1.5 m"  # note', 2, 'x: "2.0 m"  # note'),
        ("x: 50 %", 0.25, "x: 25 %"),
        ("x: -0.001", -0.0, "x: 0.000"),
        ("x: 3", 1e-9, "x: 1e-09"),
        ("x: old", "new name", "x: new name"),
        ("x: 'old'", "it's", "x: 'it''s'"),
        ('x: "old"', 'say "hi"', 'x: "say \\"hi\\""'),
        ("x: old", "yes: no", 'x: "yes: no"'),
        ("x: old", "12", 'x: "12"'),
        ("x: true", False, "x: false"),
        ("x:", 3, "x: 3"),
        ("x: &a 2.0 # anchor", 3, "x: &a 3.0 # anchor"),
        ("x: |\n  long\n  text\n# end", 3, "x: 3\n# end"),
        ("x: {a: 1, b: 2}", {"a": [1, 2]}, "x: {a: [1, 2]}"),
    ],
)
def test_a_value_keeps_its_notation(before: str, value: Any, after: str) -> None:
    assert apply(before, SetValue(("x",), value)) == after


@pytest.mark.parametrize(
    ("before", "value", "after"),
    [
        ("d: >\n  old\n  text\ne: 1\n", "new text\n", "d: >\n  new text\ne: 1\n"),
        ("d: >\n  old\ne: 1\n", "one\ntwo\n\nthree", "d: >-\n  one\n\n  two\n\n\n  three\ne: 1\n"),
        ("d:\n  f: |\n    old\n\n# end\n", "one\ntwo\n", "d:\n  f: |\n    one\n    two\n\n# end\n"),
        ("d: >\n  old\n", "  indented", 'd: "  indented"\n'),
        ("d: >\n  old\n", "x " * 100 + "end\n", "d: >\n  " + ("x " * 59)[:-1] + "\n  " + "x " * 41 + "end\n"),
    ],
)
def test_long_text_keeps_its_scalar_style_if_possible(before: str, value: str, after: str) -> None:
    keys = ("d", "f") if "f:" in before else ("d",)
    assert apply(before, SetValue(keys, value)) == after


def test_edited_alias_becomes_a_separate_value() -> None:
    assert apply("a: &n 2.0\nb: *n\n", SetValue(("b",), 3)) == "a: &n 2.0\nb: 3\n"
    with pytest.raises(EditRefused, match="is not written out in this file"):
        apply("a: &n {x: 2}\nb: [*n]\n", SetValue(("b", 0, "x"), 3))


def test_edit_that_would_change_other_values_is_refused() -> None:
    with pytest.raises(EditRefused, match="without changing other values"):
        apply("a: &n 2.0\nb: *n\n", SetValue(("a",), 3))


def test_new_keys_take_the_indentation_and_the_order_of_the_language() -> None:
    text = "simscen: 1\nrobot:\n    pose: {x: 1, y: 2}\n\n# criteria\npass:\n  - goals_reached: {}\n"
    order = ("simscen", "robot", "goals", "pass")
    goals = SetValue(("goals",), [{"name": "a"}], order)
    assert apply(text, goals) == text.replace("y: 2}\n", "y: 2}\ngoals:\n  - {name: a}\n")
    assert apply(text, SetValue(("robot", "model"), "amr")) == text.replace("y: 2}\n", "y: 2}\n    model: amr\n")
    assert apply(text, SetValue(("robot", "pose", "yaw"), "5 deg")) == text.replace("y: 2}", "y: 2, yaw: 5 deg}")
    assert apply(text, SetValue(("stack", "planner", "type"), "navfn")).endswith("stack: {planner: {type: navfn}}\n")
    robots = "robots:\n  a:\n    robot: amr\n    pass: []\n"
    first_goal = SetValue(("robots", "a", "goals", "dock"), {"x": 1}, order)
    assert apply(robots, first_goal) == robots.replace("amr\n", "amr\n    goals: {dock: {x: 1}}\n")


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("robot: amr\npass: []\n", "name: a\nrobot: amr\npass: []\n"),
        ("# aisle\n\nother: 1\nrobot: amr\n", "# aisle\n\nother: 1\nname: a\nrobot: amr\n"),
        ("- robot: amr\n  pass: []\n", "- name: a\n  robot: amr\n  pass: []\n"),
        ("{robot: amr, pass: []}", "{name: a, robot: amr, pass: []}"),
        ("[robot: amr]", "[{robot: amr, name: a}]"),
        ("other: 1\n", "other: 1\nname: a\n"),
    ],
)
def test_new_key_is_inserted_in_the_order_of_the_language(before: str, after: str) -> None:
    keys = ("name",) if isinstance(plain(before), dict) else (0, "name")
    assert apply(before, SetValue(keys, "a", ("simscen", "name", "robot", "pass"))) == after


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("g: [1, 2]\n", "g: [1, 2, 3]\n"),
        ("g: []\n", "g: [3]\n"),
        ("g:\n- 1\n- 2 # two\nh: 1\n", "g:\n- 1\n- 2 # two\n- 3\nh: 1\n"),
        ("g:\n    - 1\n\n    - 2\n", "g:\n    - 1\n\n    - 2\n\n    - 3\n"),
        ("g: [\n  1,\n  2,\n]\n", "g: [\n  1,\n  2,\n  3,\n]\n"),
        ("g:\n  - 1", "g:\n  - 1\n  - 3"),
        ("g:\n  - &b-c\n    # - d\n    1\n", "g:\n  - &b-c\n    # - d\n    1\n  - 3\n"),
        ("h: 1\n", "h: 1\ng: [3]\n"),
        ("{h: 1}", "{h: 1, g: [3]}"),
    ],
)
def test_a_new_item_looks_like_its_siblings(before: str, after: str) -> None:
    assert apply(before, AddItem(("g",), 3)) == after


def test_an_item_is_inserted_before_an_item_with_an_anchor() -> None:
    text = "g:\n  - 1\n  - &b-c 2\n"
    assert apply(text, AddItem(("g",), 3, 1)) == "g:\n  - 1\n  - 3\n  - &b-c 2\n"


def test_new_block_item_has_the_style_of_the_previous_item() -> None:
    text = "goals:\n  - name: a\n    pose:\n      x: 1\n      y: 2\npass: []\n"
    goal = {"name": "b", "pose": {"x": 3, "y": 4.5}, "timeout": "5 s"}
    added = "  - name: b\n    pose:\n      x: 3\n      y: 4.5\n    timeout: 5 s\n"
    assert apply(text, AddItem(("goals",), goal)) == text.replace("pass", f"{added}pass")


@pytest.mark.parametrize(
    ("before", "keys", "after"),
    [
        ("a: 1\nb: 2 # two\nc: 3\n", ("b",), "a: 1\nc: 3\n"),
        ("a: 1\nb: 2", ("b",), "a: 1"),
        ("a: {b: 1, c: 2, d: 3}\n", ("a", "c"), "a: {b: 1, d: 3}\n"),
        ("a: {b: 1, c: 2}\n", ("a", "b"), "a: {c: 2}\n"),
        ("a: [1, 2, 3]\n", ("a", 2), "a: [1, 2]\n"),
        ("a: [1]\n", ("a", 0), "a: []\n"),
        ("a:\n  - x: 1\n    y: 2\n  - x: 3\n", ("a", 0), "a:\n  - x: 3\n"),
        ("a:\n  - x: 1\n    y: 2\n", ("a", 0, "x"), "a:\n  - y: 2\n"),
        ("a:\n  - x: 1\n    y: 2\n", ("a", 0, "y"), "a:\n  - x: 1\n"),
        ("a:\n  - 1\nb: 2\n", ("a", 0), "a: []\nb: 2\n"),
        ("a:\n- &go-home {x: a}\n- {x: b}\n", ("a", 0), "a:\n- {x: b}\n"),
        ("a:\n- # go-home\n  x: a\n- {x: b}\n", ("a", 0), "a:\n- {x: b}\n"),
        ("a:\n- !!map &b-c\n  # - d\n\n  x: a\n- {x: b}\n", ("a", 0), "a:\n- {x: b}\n"),
        ("a:\n  - - &b-c 1\n    - 2\n  - 3\n", ("a", 0, 0), "a:\n  - - 2\n  - 3\n"),
        ("a: [b: {c: 0}]\n", ("a", 0, "b"), "a: [{}]\n"),
        ("a: [1, b: 0, 2]\n", ("a", 1, "b"), "a: [1, {}, 2]\n"),
        ("a: # b:\n  b: x\n", ("a", "b"), "a: # b:\n  {}\n"),
        ("# b:\na: x\n", ("a",), "# b:\n{}\n"),
        ("'a' :\n  b: x\n", ("a", "b"), "'a': {}\n"),
    ],
)
def test_removed_part_leaves_the_expected_text(before: str, keys: tuple[Key, ...], after: str) -> None:
    assert apply(before, RemovePart(keys)) == after


def _leaves(value: Any, keys: tuple[Key, ...] = ()) -> list[tuple[Key, ...]]:
    """Return the keys that lead to each value that is neither a mapping nor a list."""
    if isinstance(value, dict):
        return [leaf for key, item in value.items() for leaf in _leaves(item, (*keys, key))]
    if isinstance(value, list):
        return [leaf for index, item in enumerate(value) for leaf in _leaves(item, (*keys, index))]
    return [keys]


def _value_at(value: Any, keys: tuple[Key, ...]) -> Any:
    for key in keys:
        value = value[key]
    return value


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_any_edit_of_a_shipped_file_changes_only_its_span(data: st.DataObject) -> None:
    text = data.draw(st.sampled_from(SHIPPED)).read_text(encoding="utf-8")
    keys = data.draw(st.sampled_from(_leaves(plain(text))))
    number = st.floats(-1e4, 1e4).map(lambda value: round(value, 3))
    value = data.draw(
        number | st.text(st.characters(codec="utf-8", exclude_categories=["C"]), min_size=1) | st.booleans()
    )
    source = parse_source(text)
    node = None if source is None else source_at(source, keys)
    assert node is not None
    edited = apply(text, SetValue(keys, value))
    assert edited.startswith(text[: node.start]) and edited.endswith(text[node.end :])
    assert is_same_value(_value_at(plain(edited), keys), value)
    if isinstance(value, float):
        edited_number = si_number(_value_at(plain(edited), keys))
        assert math.isclose(edited_number, value, rel_tol=1e-9, abs_tol=2e-6)
    others = [leaf for leaf in _leaves(plain(text)) if leaf != keys]
    assert all(_value_at(plain(edited), leaf) == _value_at(plain(text), leaf) for leaf in others)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_removing_an_added_part_restores_a_shipped_file(data: st.DataObject) -> None:
    text = data.draw(st.sampled_from(SHIPPED)).read_text(encoding="utf-8")
    lists = [("goals",), ("events",), ("pass",), ("obstacles",), ("walls",), ("regions", "hall"), ("tags",)]
    keys = data.draw(st.sampled_from(lists))
    items = plain(text)
    for key in keys:
        items = items.get(key) if isinstance(items, dict) else None
    if not isinstance(items, list):
        return
    added = apply(text, AddItem(keys, {"name": "new", "pose": {"x": 1.5, "y": 2}}))
    assert apply(added, RemovePart((*keys, len(items)))) == text


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.name)
def test_setting_each_value_to_itself_does_not_change_a_shipped_file(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    data = plain(text)
    numbers = [keys for keys in _leaves(data) if isinstance(_value_at(data, keys), int | float)]
    kept = [SetValue(keys, _value_at(data, keys)) for keys in numbers]
    assert apply(text, *kept) == text


@pytest.mark.parametrize("value", [10**400, math.inf, True, "1 lightyear"])
def test_values_that_are_not_finite_numbers_are_not_shown_on_the_map(value: Any) -> None:
    assert number(value) is None


def test_keyframe_that_is_not_in_the_text_is_refused() -> None:
    """The time of the keyframe is unknown, so that the list cannot be written."""
    change = {"op": "keyframe", "keys": ["events", 0, "do", "move", "keyframes", 1], "x": 1, "y": 2}
    with pytest.raises(EditRefused, match="not a list in this file"):
        read_edits([change], "simscen: 1\nextends: base.scenario.yaml\n", "scenario")
