"""Text of a scenario for logs, and the criteria in such a text."""

from collections.abc import Mapping
from dataclasses import replace

from simscen.core.errors import InvalidInput, Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.multirobot import has_valid_robots, split_by_robot
from simscen.loading.named_places import places_of, resolve_criteria_places
from simscen.loading.plugins import missing_plugins
from simscen.loading.schema.validate import Model, check
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode, Node
from simscen.loading.yaml.writing import to_yaml
from simscen.model.scenario import CriteriaSpec, ScenarioSpec

JUDGING_PLUGINS = frozenset({"criterion", "metric"})
"""Groups of the registry with types that are needed to judge a log."""
_JUDGING_KEYS = frozenset({"simscen", "pass", "metrics", "expected"})
"""Top-level keys of a scenario that are needed to judge a log of it."""


def resolved_text(loaded: LoadedScenario) -> str:
    """Return the scenario, or its variation, as one text without `extends`, with poses for place names in criteria."""
    file_tree, _ = parse_yaml(loaded.text, loaded.path)
    plain = resolve_criteria_places(loaded.tree.plain, _validated(ScenarioSpec, loaded.tree), places_of(loaded.world))
    if isinstance(file_tree, MappingNode) and file_tree.plain == plain:
        return loaded.text
    return to_yaml(plain)


def criteria_and_tree(text: str, robot: str) -> tuple[CriteriaSpec, MappingNode]:
    """Return the criteria in a scenario text, and the YAML tree. Raises InvalidInput.

    `robot` is the name of one of several robots; "" for the only robot.
    """
    tree = _read(text, "scenario.yaml")
    if isinstance(tree, MappingNode) and robot:
        tree = _robot_tree(tree, robot) or tree
    spec = _validated(CriteriaSpec, tree)
    assert isinstance(tree, MappingNode)
    return spec, tree


def criteria_of_text(text: str, name: str, facts: Mapping[str, str], robot: str = "") -> CriteriaSpec:
    """Return the criteria in the scenario text of a log, ignoring the rest of the scenario.

    `name` is the path of the text in messages, and `facts` are the header entries of the log. `robot` is the name of
    one of several robots; "" for the only robot. Raises InvalidInput, also for a robot that the scenario does not have,
    and for a plug-in that is not installed in the version of the log.
    """
    if missing := missing_plugins(facts, JUDGING_PLUGINS):
        raise InvalidInput([replace(problem, path=name) for problem in missing])
    tree = _read(text, name)
    if isinstance(tree, MappingNode):
        robot_tree = _robot_tree(tree, robot) if robot else tree
        if robot_tree is None:
            message = f"the log is damaged: its scenario has no robot `{robot}`"
            raise InvalidInput([Problem(name, 0, 0, "SC802", message)])
        entries = {key: entry for key, entry in robot_tree.entries.items() if key in _JUDGING_KEYS}
        tree = replace(robot_tree, entries=entries)
    return _validated(CriteriaSpec, tree)


def _robot_tree(tree: MappingNode, robot: str) -> MappingNode | None:
    """Return the scenario of one of several robots; None if the scenario does not have it."""
    return split_by_robot(tree).get(robot) if has_valid_robots(tree) else None


def _read(text: str, name: str) -> Node:
    tree, problems = parse_yaml(text, name)
    if tree is None or problems:
        raise InvalidInput(problems)
    return tree


def _validated(model: type[Model], tree: Node) -> Model:
    spec = check(model, tree)
    if isinstance(spec, list):
        raise InvalidInput(spec)
    return spec
