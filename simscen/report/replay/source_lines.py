"""Where in the scenario's text stands what a replay tells of: its criteria, goals, events and faults."""

from dataclasses import dataclass, field
from itertools import count
from typing import Any

from simscen.core.errors import InvalidInput
from simscen.criteria.registry import verdict_names
from simscen.loading.resolved import parts_of_text
from simscen.loading.yaml.tree import Key, MappingNode, key_position
from simscen.model.scenario import ScenarioSpec


@dataclass(frozen=True)
class SourceLines:
    """Lines of a scenario's text, from 1: of criteria by the names of their verdicts, of goals by name, of events and
    faults by their numbers. What is not known is not in it."""

    criteria: dict[str, int] = field(default_factory=dict)
    goals: dict[str, int] = field(default_factory=dict)
    events: dict[int, int] = field(default_factory=dict)
    faults: dict[int, int] = field(default_factory=dict)


def read_source_lines(text: str, robot: str = "") -> tuple[SourceLines, ScenarioSpec | None]:
    """The lines in a log's text, and what it specifies; nothing where a package that it was made with is gone."""
    if not text:
        return SourceLines(), None
    try:
        spec, tree = parts_of_text(text, "scenario.yaml", robot)
    except InvalidInput:
        return SourceLines(), None
    names = verdict_names(spec.pass_)
    sent = {
        action.chosen.name: _line(tree, *keys)
        for step in spec.steps
        for keys, action in step.located_actions()
        if action.kind == "new_goal" and hasattr(action.chosen, "name")
    }
    return SourceLines(
        criteria={name: _line(tree, "pass", index) for index, name in enumerate(names)},
        goals=sent | {name: _line(tree, "goals", index) for index, name in enumerate(_goal_names(spec))},
        events={number: _line(tree, *step.keys) for number, step in enumerate(spec.steps)},
        faults={index: _line(tree, "faults", index) for index in range(len(spec.faults))},
    ), spec


def _goal_names(spec: ScenarioSpec) -> list[str]:
    """As ScenarioSpec.goal_names, of a specification in which places are still names."""
    taken, names = {goal.name for goal in spec.goals}, list[str]()
    for number, goal in enumerate(spec.goals, start=1):
        pose: Any = goal.pose
        default = pose if isinstance(pose, str) else f"goal-{number}"
        others = (name for again in count(2) if (name := f"{default}-{again}") not in taken)
        names.append(goal.name or (default if default not in taken else next(others)))
        taken.add(names[-1])
    return names


def _line(tree: MappingNode, *keys: Key) -> int:
    return key_position(tree, keys).line
