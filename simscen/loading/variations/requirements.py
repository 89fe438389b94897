"""Check the conditions in `require:` with the values of a variation."""

from collections.abc import Iterable, Mapping
from typing import Any

from simscen.loading.variations.conditions import Condition
from simscen.loading.variations.options import Change
from simscen.loading.variations.paths import PathError, resolve_path
from simscen.loading.yaml.tree import MappingNode, Node, child


def plain_values(tree: MappingNode, conditions: Iterable[Condition], changes: Iterable[Change]) -> dict[str, Any]:
    """Return the values of all paths of the conditions: as changed, or as written in the scenario."""
    changed = {change.target.path: change.value.plain for change in changes}
    paths = {path for condition in conditions for path in condition.paths}
    return {path: changed[path] if path in changed else written_value(tree, path) for path in sorted(paths)}


def all_hold(conditions: Iterable[Condition], values: Mapping[str, Any]) -> bool:
    """Return whether all conditions hold for these values. Raises ConditionError."""
    return all(condition.holds(values) for condition in conditions)


def written_value(tree: MappingNode, path: str) -> Any:
    """Return the value that the scenario has at a path, or None."""
    try:
        keys = resolve_path(path, tree.position, tree).keys
    except PathError:
        return None
    node: Node | None = tree
    for key in keys:
        node = None if node is None else child(node, key)
    return None if node is None else node.plain
