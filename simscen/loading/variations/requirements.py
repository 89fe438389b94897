"""Check of the conditions in `require:` for the values of a variation."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from simscen.loading.variations.axes import AxisBuilder, Change
from simscen.loading.variations.conditions import GRAMMAR, Condition, ConditionError, parse_condition
from simscen.loading.variations.paths import PathError, resolve_path
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, SequenceNode, child


def read_conditions(node: Node | None, builder: AxisBuilder) -> list[Condition]:
    """Return the conditions of a block; reports those that cannot be read to the builder."""
    found: list[Condition] = []
    for item in node.items if isinstance(node, SequenceNode) else ():
        assert isinstance(item, ScalarNode)
        try:
            found.append(parse_condition(str(item.value)))
        except ConditionError as error:
            builder.add(item.place, "SC017", str(error), GRAMMAR)
    return found


def check_paths(conditions: Sequence[Condition], node: Node | None, builder: AxisBuilder) -> None:
    """Report paths of conditions that are neither varied nor written in the scenario, if all could be read."""
    if not isinstance(node, SequenceNode) or len(conditions) < len(node.items):
        return
    for condition, item in zip(conditions, node.items, strict=True):
        for path in condition.paths:
            if path not in builder.targets and _written_value(builder.tree, path) is None:
                message = f"`{path}` is neither varied nor written in the scenario"
                builder.add(item.place, "SC030", message, "write its value, or vary it")


def plain_values(tree: MappingNode, conditions: Iterable[Condition], changes: Iterable[Change]) -> dict[str, Any]:
    """Return the values of all paths of the conditions: as changed, or as written in the scenario."""
    changed = {change.target.path: change.value.plain for change in changes}
    paths = {path for condition in conditions for path in condition.paths}
    return {path: changed[path] if path in changed else _written_value(tree, path) for path in sorted(paths)}


def all_hold(conditions: Iterable[Condition], values: Mapping[str, Any]) -> bool:
    """Return whether all conditions hold for these values. Raises ConditionError."""
    return all(condition.holds(values) for condition in conditions)


def _written_value(tree: MappingNode, path: str) -> Any:
    """Return the value that the scenario has at a path, or None."""
    try:
        keys = resolve_path(path, tree.place, tree).keys
    except PathError:
        return None
    node: Node | None = tree
    for key in keys:
        node = None if node is None else child(node, key)
    return None if node is None else node.plain
