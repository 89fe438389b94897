"""What a log records of a scenario: a self-contained text, which can be read again, and its events and faults."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import yaml

from simscen.core.errors import InvalidInput
from simscen.core.records.events import Disturbance
from simscen.loading.files.paths import PathSandbox
from simscen.loading.loaded import LoadedScenario
from simscen.loading.multirobot import split_by_robot
from simscen.loading.named_places import places_of, resolve_criteria_places
from simscen.loading.plugins import missing_plugins
from simscen.loading.schema.validate import Model, check
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.scalars import to_yaml
from simscen.loading.yaml.tree import Key, MappingNode, Node, node_at
from simscen.model.scenario import CriteriaSpec, ScenarioSpec

JUDGING_PLUGINS = frozenset({"criterion", "metric"})
"""Kinds of plugins that are needed to judge a log."""
_JUDGING_KEYS = frozenset({"simscen", "pass", "metrics", "expected"})
"""Top-level keys of a scenario that are needed to judge a log."""


def resolved_text(loaded: LoadedScenario) -> str:
    """Return the scenario (or its variation) as one text, without `extends` and without places in criteria.

    The text is the file as written if nothing had to be merged or replaced. Names of places in criteria are replaced by
    poses, because logs are judged without the world.
    """
    own, _ = parse_yaml(loaded.text, loaded.path)
    plain = resolve_criteria_places(loaded.tree.plain, _validated(ScenarioSpec, loaded.tree), places_of(loaded.world))
    if isinstance(own, MappingNode) and own.plain == plain:
        return loaded.text
    return to_yaml(plain)


def unexpanded_text(loaded: LoadedScenario) -> str:
    """Return the scenario as one text without `extends`, with `variations` instead of the values of this variation."""
    if not loaded.variation:
        return resolved_text(loaded)
    own, _ = parse_yaml(loaded.text, loaded.path)
    tree, _ = Library(PathSandbox.around(loaded.root, loaded.world_path)).read(loaded.file, defaults=True)
    return loaded.text if tree is None or own is None or own.plain == tree.plain else to_yaml(tree.plain)


def spec_of_text(text: str, name: str) -> ScenarioSpec:
    """Return the specification in a text of `resolved_text`; `name` is its name in problems. Raises InvalidInput."""
    return _validated(ScenarioSpec, _read(text, name))


def parts_of_text(text: str, name: str, robot: str = "") -> tuple[CriteriaSpec, MappingNode]:
    """Return the criteria in a text of `resolved_text`, or of a file with criteria only, and the tree of the text.

    `robot` selects one of several robots. `name` is the name of the text in problems. Raises InvalidInput.
    """
    tree = _read(text, name)
    if isinstance(tree, MappingNode) and robot:
        tree = split_by_robot(tree).get(robot, tree)
    spec = _validated(CriteriaSpec, tree)
    assert isinstance(tree, MappingNode)
    return spec, tree


def criteria_of_text(text: str, name: str, facts: Mapping[str, str], robot: str = "") -> CriteriaSpec:
    """Return the criteria in the scenario text of a log; `robot` selects one of several robots.

    `name` is the name of the text in problems, and `facts` are the entries in the header of the log. The rest of the
    scenario is ignored, so plugins that it uses for other things than criteria and metrics need not be installed.
    Raises InvalidInput, also if a criterion or metric is not installed in the version of the log.
    """
    if missing := missing_plugins(facts, JUDGING_PLUGINS):
        raise InvalidInput([replace(problem, path=name) for problem in missing])
    tree = _read(text, name)
    if isinstance(tree, MappingNode):
        tree = split_by_robot(tree)[robot] if robot else tree
        tree = replace(tree, entries={key: entry for key, entry in tree.entries.items() if key in _JUDGING_KEYS})
    return _validated(CriteriaSpec, tree)


def _read(text: str, name: str) -> Node:
    """Return the tree of a text. Raises InvalidInput."""
    tree, problems = parse_yaml(text, name)
    if tree is None or problems:
        raise InvalidInput(problems)
    return tree


def _validated(model: type[Model], tree: Node) -> Model:
    """Return the specification in a tree. Raises InvalidInput."""
    spec = check(model, tree)
    if isinstance(spec, list):
        raise InvalidInput(spec)
    return spec


def disturbances_of(loaded: LoadedScenario) -> tuple[Disturbance, ...]:
    """Return the events, each followed by the steps of its sequence, then the faults, in the order of the scenario."""
    return (*_events(loaded), *_faults(loaded))


def _events(loaded: LoadedScenario) -> Iterator[Disturbance]:
    for step in loaded.spec.steps:
        when = "" if step.when is None else _one_line_yaml(loaded, *step.keys, "when")
        yield Disturbance(step.name, "event", when, step.required, _line(loaded, *step.keys), step.after)


def _faults(loaded: LoadedScenario) -> Iterator[Disturbance]:
    for index, entry in enumerate(loaded.spec.faults):
        keys = ("faults", index)
        when = "" if entry.when is None else _one_line_yaml(loaded, *keys, "when")
        yield Disturbance(entry.label, "fault", when, entry.required, _line(loaded, *keys))


def _one_line_yaml(loaded: LoadedScenario, *keys: Key) -> str:
    """Return the mapping at `keys` as one line of YAML without braces."""
    text = yaml.safe_dump(
        node_at(loaded.tree, keys).plain, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**9
    )
    return text.strip().removeprefix("{").removesuffix("}")


def _line(loaded: LoadedScenario, *keys: Key) -> int:
    """Return the line of the value at `keys` in the scenario file; 0 if it is in a file that the scenario extends."""
    position = loaded.position_of(*keys)
    return position.line if position.path == loaded.path else 0
