"""Lines of criteria, goals, events, and faults in a scenario file, to which the replay page links."""

from dataclasses import dataclass, field
from itertools import count
from typing import Any

from simscen.core.errors import InvalidInput
from simscen.criteria.registry import verdict_names
from simscen.loading.scenario_text import criteria_and_tree
from simscen.loading.yaml.tree import Key, MappingNode, key_position
from simscen.model.scenario import ScenarioSpec


@dataclass(frozen=True)
class SourceLines:
    """Line numbers in a scenario file: of criteria and goals by name, of events and faults by index."""

    criteria: dict[str, int] = field(default_factory=dict)
    goals: dict[str, int] = field(default_factory=dict)
    events: dict[int, int] = field(default_factory=dict)
    faults: dict[int, int] = field(default_factory=dict)


def read_source_lines(text: str, robot: str = "") -> tuple[SourceLines, ScenarioSpec | None]:
    """Return (line numbers for a robot, specification) of the scenario in `text`.

    `robot` is "" for a single robot. Return no line numbers and None if the text is empty or the scenario is invalid.
    """
    if not text:
        return SourceLines(), None
    try:
        spec, tree = criteria_and_tree(text, robot)
    except InvalidInput:
        return SourceLines(), None
    names = verdict_names(spec.pass_)
    new_goals = {
        action.spec.name: _source_line(tree, *action.keys[:-1])
        for step in spec.steps
        for action in step.actions
        if action.kind == "new_goal"
    }
    return SourceLines(
        criteria={name: _source_line(tree, "pass", index) for index, name in enumerate(names)},
        goals=new_goals | {name: _source_line(tree, "goals", index) for index, name in enumerate(_goal_names(spec))},
        events={number: _source_line(tree, *step.keys) for number, step in enumerate(spec.steps)},
        faults={index: _source_line(tree, "faults", index) for index in range(len(spec.faults))},
    ), spec


def _goal_names(spec: ScenarioSpec) -> list[str]:
    """Return the names of all goals. Unlike in ScenarioSpec.goal_names, a pose can be the name of a place."""
    used_names, names = {goal.name for goal in spec.goals}, list[str]()
    for number, goal in enumerate(spec.goals, start=1):
        pose: Any = goal.pose
        default = pose if isinstance(pose, str) else f"goal-{number}"
        numbered = (name for suffix in count(2) if (name := f"{default}-{suffix}") not in used_names)
        names.append(goal.name or (default if default not in used_names else next(numbered)))
        used_names.add(names[-1])
    return names


def _source_line(tree: MappingNode, *keys: Key) -> int:
    return key_position(tree, keys).line
