"""Scenarios of several robots (`robots`): splits the YAML tree into one scenario per robot, and checks the keys."""

from simscen.core.errors import Problem
from simscen.loading.stacks.choice import EXTERNAL, StackChoice, replace_stack
from simscen.loading.yaml.library import merge_mappings
from simscen.loading.yaml.tree import Entry, MappingNode, ScalarNode, SequenceNode, child, entries_of, items_of
from simscen.model.scenario import RobotEntry

ROBOT, ROBOTS, PASS, EXPECTED, STACK = "robot", "robots", "pass", "expected", "stack"
"""Keys of a scenario."""
ROBOT_KEYS = ("goals", "faults")
"""Keys that are at top level for a single robot, and under each robot if there are several."""


def split_by_robot(tree: MappingNode) -> dict[str, MappingNode]:
    """Return a scenario tree for each robot alone, without `expected`, sorted by name; {} without `robots`."""
    robots = entries_of(child(tree, ROBOTS))
    return {name: _single_robot_tree(tree, robots[name]) for name in sorted(robots)}


def has_valid_robots(tree: MappingNode) -> bool:
    """Return whether a scenario has the key `robots`, and its value is a mapping from names to mappings."""
    robots = child(tree, ROBOTS)
    values = [entry.value for entry in entries_of(robots).values()]
    return isinstance(robots, MappingNode) and all(isinstance(value, MappingNode) for value in values)


def _single_robot_tree(tree: MappingNode, entry: Entry) -> MappingNode:
    """Return the scenario tree of the robot in `entry`. `tree` is the scenario of all robots.

    Keys of the robot override keys at top level. Criteria of the robot are added to the criteria at top level.
    """
    robot_tree, position = entry.value, entry.value.position
    assert isinstance(robot_tree, MappingNode)
    robot = {key: value for key, value in robot_tree.entries.items() if key in RobotEntry.model_fields}
    other_keys = {key: value for key, value in robot_tree.entries.items() if key not in robot and key != PASS}
    merged = merge_mappings(MappingNode(tree.position, other_keys), tree.without_keys(ROBOTS, EXPECTED))
    criteria = SequenceNode(tree.position, (*items_of(child(tree, PASS)), *items_of(child(robot_tree, PASS))))
    return MappingNode(
        tree.position,
        {**merged.entries, ROBOT: Entry(entry.key, MappingNode(position, robot)), PASS: Entry(entry.key, criteria)},
    )


def apply_stack_choice(tree: MappingNode, choice: StackChoice) -> MappingNode:
    """Return a scenario tree in which the selected stack replaces the stacks of all robots.

    If one of several robots already uses the external stack that `choice` starts, the tree is unchanged.
    """
    if ROBOTS not in tree.entries:
        return replace_stack(tree, choice)
    if not has_valid_robots(tree):
        return tree  # validation reports the wrong type
    parts = split_by_robot(tree)
    if choice.external_command is not None and choice.name in map(external_stack_name, parts.values()):
        return tree
    chosen = {name: replace_stack(part, choice) for name, part in parts.items()}
    if all(chosen[name] is part for name, part in parts.items()):
        return tree
    changed = tree.without_keys(STACK)
    for name, part in chosen.items():
        if (stack := part.entries.get(STACK)) is not None:
            changed = changed.with_value((ROBOTS, name, STACK), stack.value, stack.key)
    return changed


def external_stack_name(tree: MappingNode) -> str | None:
    """Return the name of the external stack of a scenario of one robot; None if it has another stack."""
    stack = child(tree, STACK)
    name = None if stack is None else child(stack, EXTERNAL)
    return str(name.value) if isinstance(name, ScalarNode) else None


def scenario_robot_problems(tree: MappingNode) -> list[Problem]:
    """Return problems of a scenario: missing `robot`, missing criteria, and keys that `robots` excludes."""
    problems = criteria_robot_problems(tree)
    if ROBOTS not in tree.entries and ROBOT not in tree.entries:
        problems.append(Problem(*tree.position, "SC010", f"missing key `{ROBOT}`"))
    return problems


def criteria_robot_problems(tree: MappingNode) -> list[Problem]:
    """Return problems of a criteria file: missing criteria, and keys that `robots` excludes."""
    problems: list[Problem] = []
    criteria, robots = child(tree, PASS), child(tree, ROBOTS)
    if isinstance(criteria, SequenceNode) and not criteria.items:
        problems.append(Problem(*criteria.position, "SC017", "expected 1 or more values, got 0"))
    if robots is None:
        if criteria is None:
            problems.append(Problem(*tree.position, "SC010", f"missing key `{PASS}`"))
        return problems
    if ROBOT in tree.entries:
        message = "`robot` and `robots` exclude each other"
        hint = "use `robot` for one robot; for several, list each under its name in `robots`"
        problems.append(Problem(*tree.entries[ROBOT].key, "SC016", message, hint))
    for key in ROBOT_KEYS:
        if key in tree.entries:
            message = f"`{key}` belongs to one robot, but the scenario has several"
            hint = f"move them to each robot in `{ROBOTS}`"
            problems.append(Problem(*tree.entries[key].key, "SC016", message, hint))
    for name, entry in entries_of(robots).items():
        robot_criteria = child(entry.value, PASS)
        if isinstance(entry.value, MappingNode) and not items_of(criteria) and not items_of(robot_criteria):
            message = f"missing key `{PASS}` in `{ROBOTS}.{name}`"
            hint = "add criteria for this robot, or for all robots at top level"
            problems.append(Problem(*entry.key, "SC010", message, hint))
    return problems
