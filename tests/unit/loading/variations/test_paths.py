"""Tests of paths of variations."""

import pytest

from simscen.loading.variations.paths import PathError, resolve_path
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode, Position, ScalarNode, node_at

TEXT = """\
world: {objects: [{name: old cart, box: [1, 1, 1]}]}
robot: {pose: {x: 1, y: 2}}
goals: [{pose: sofa}, {name: the.end, pose: {x: 1, y: 2}}, desk]
faults: [{sensor: lidar, noise: {std: 1}}, {sensor: lidar, off: {}}, {sensor: odom, name: drifts, bias: {x: 1}}]
pass: [{collisions: {max: 0}}, {clearance: {min: 1}, id: near}, {stuck: 1}, {always: {}}, {always: {}}]
"""
HERE = Position("x", 9, 9)


@pytest.fixture
def tree() -> MappingNode:
    found, _ = parse_yaml(TEXT, "x")
    assert isinstance(found, MappingNode)
    return found


@pytest.mark.parametrize(
    ("path", "keys"),
    [
        ("robot.pose.x", ("robot", "pose", "x")),
        ("robot", ("robot",)),
        ("goals[0].pose", ("goals", 0, "pose")),
        ("goals.0.pose", ("goals", 0, "pose")),
        ("goals.sofa.timeout", ("goals", 0, "timeout")),
        ("goals.desk", ("goals", 2)),
        ("goals[sofa].timeout", ("goals", 0, "timeout")),
        ('goals["the.end"].pose.x', ("goals", 1, "pose", "x")),
        ("world.objects.old cart.box[2]", ("world", "objects", 0, "box", 2)),
        ("faults.lidar.noise.std", ("faults", 0, "noise", "std")),
        ("faults.lidar.off.x", ("faults", 1, "off", "x")),
        ("faults.drifts.for", ("faults", 2, "for")),
        ("pass.collisions.max", ("pass", 0, "collisions", "max")),
        ("pass[0].collisions.max", ("pass", 0, "collisions", "max")),
        ("pass.collisions.severity", ("pass", 0, "severity")),
        ("pass.near.clearance.min", ("pass", 1, "clearance", "min")),
        ("pass.stuck", ("pass", 2, "stuck")),
        ("stack.controller.desired_linear_vel", ("stack", "controller", "desired_linear_vel")),
    ],
)
def test_a_path_leads_to_the_value_that_a_user_means(tree: MappingNode, path: str, keys: tuple[str | int, ...]) -> None:
    target = resolve_path(path, HERE, tree)
    assert target.keys == keys
    value = ScalarNode(HERE, 7)
    assert node_at(tree.with_value(target.keys, value, target.position), keys) is value


def test_position_of_a_missing_value_is_that_of_the_path(tree: MappingNode) -> None:
    keys = resolve_path("stack.controller.x", HERE, tree).keys
    changed = tree.with_value(keys, ScalarNode(HERE, 7), HERE)
    assert changed.plain["stack"] == {"controller": {"x": 7}}
    assert changed.entries["stack"].key == HERE
    assert {**changed.plain, "stack": None} == {**tree.plain, "stack": None}


@pytest.mark.parametrize(
    ("path", "text", "hint"),
    [
        ("", "`` is not a valid path", "join keys with dots"),
        (".x", "`.x` is not a valid path", "join keys with dots"),
        ("a..b", "`a..b` is not a valid path", "join keys with dots"),
        ("a[", "`a[` is not a valid path", "join keys with dots"),
        ("a[]", "`a[]` is not a valid path", "join keys with dots"),
        ("goals[3].pose", "leads to nothing: `goals` has 3 items", "the first item is [0]"),
        ("goals.sofer.pose", "no item of `goals` is called `sofer`", "did you mean `sofa`?"),
        ("goals[0].pose.x", "`goals[0].pose` is `sofa`, without a `x`", "vary `goals[0].pose` as a whole"),
        ("faults.lidar", "is ambiguous: 2 items of `faults`", "faults[0], faults[1]"),
        ("pass.always.x", "is ambiguous: 2 items of `pass`", "pass[3], pass[4]"),
        ("pass.clearence.min", "no item of `pass` is called `clearence`", "did you mean `clearance`?"),
        ("events.door.when", "the scenario has no `events`", ""),
        ("simscen", "a variation cannot change `simscen`", "one version of the language"),
        ("variations.grid", "a variation cannot change `variations`", "cannot be nested"),
    ],
)
def test_unknown_path_is_reported_with_the_existing_keys(tree: MappingNode, path: str, text: str, hint: str) -> None:
    with pytest.raises(PathError) as raised:
        resolve_path(path, HERE, tree)
    assert text in str(raised.value)
    assert hint in raised.value.hint
    assert bool(hint) == bool(raised.value.hint)


def test_variation_of_a_value_in_another_file_is_reported() -> None:
    tree, _ = parse_yaml("world: room.world.yaml\n", "x")
    assert isinstance(tree, MappingNode)
    with pytest.raises(PathError) as raised:
        resolve_path("world.objects[0].box", HERE, tree)
    assert "values in another file cannot be varied" in raised.value.hint
