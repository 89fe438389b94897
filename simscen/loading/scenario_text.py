"""A scenario as one self-contained text, for logs and output folders, and its events and faults in a log."""

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


def resolved_text(loaded: LoadedScenario) -> str:
    """Return the file as written, or merged with what it `extends` and `defaults.yaml`.

    Names of places in criteria are replaced by poses, because logs are judged without the world.
    """
    own, _ = parse_yaml(loaded.text, loaded.path)
    plain = resolve_criteria_places(loaded.tree.plain, _validated(ScenarioSpec, loaded.tree), places_of(loaded.world))
    if isinstance(own, MappingNode) and own.plain == plain:
        return loaded.text
    return to_yaml(plain)


def unexpanded_text(loaded: LoadedScenario) -> str:
    """Return the same text, but with `variations` instead of the values of one variation."""
    if not loaded.variation:
        return resolved_text(loaded)
    own, _ = parse_yaml(loaded.text, loaded.path)
    tree, _ = Library(PathSandbox.around(loaded.root, loaded.world_path)).read(loaded.file, defaults=True)
    return loaded.text if tree is None or own is None or own.plain == tree.plain else to_yaml(tree.plain)


def spec_of_text(text: str, name: str) -> ScenarioSpec:
    """Return the specification in a resolved text; `name` is its name in problems. Raises InvalidInput."""
    return _validated(ScenarioSpec, _read(text, name))


def parts_of_text(text: str, name: str, robot: str = "") -> tuple[CriteriaSpec, MappingNode]:
    """Return the criteria in a resolved text, of one of several robots if given, and the tree with their positions.

    The text may be a file with criteria only. Raises InvalidInput.
    """
    tree = _read(text, name)
    if isinstance(tree, MappingNode) and robot:
        tree = split_by_robot(tree).get(robot, tree)
    spec = _validated(CriteriaSpec, tree)
    assert isinstance(tree, MappingNode)
    return spec, tree


def criteria_of_text(text: str, name: str, facts: Mapping[str, str], robot: str = "") -> CriteriaSpec:
    """Return the criteria in the resolved text of a log, for `robot` if there are several.

    `name` is the name of the text in problems, `facts` are the entries in the header of the log. Other parts of the
    scenario are ignored, so plugins other than criteria and metrics need not be installed. Raises InvalidInput, also if
    a criterion is not installed in the version of the log.
    """
    if missing := missing_plugins(facts, JUDGING_PLUGINS):
        raise InvalidInput([replace(problem, path=name) for problem in missing])
    tree = _read(text, name)
    if isinstance(tree, MappingNode):
        tree = split_by_robot(tree)[robot] if robot else tree
        tree = replace(tree, entries={key: entry for key, entry in tree.entries.items() if key in _JUDGING_KEYS})
    return _validated(CriteriaSpec, tree)


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


def disturbances_of(loaded: LoadedScenario) -> tuple[Disturbance, ...]:
    """Return the events, each followed by the steps of its story, then the faults, in the order of the scenario."""
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
    """Return a mapping on one line of YAML, without its braces."""
    text = yaml.safe_dump(
        node_at(loaded.tree, keys).plain, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**9
    )
    return text.strip().removeprefix("{").removesuffix("}")


def _line(loaded: LoadedScenario, *keys: Key) -> int:
    """Return the line in the scenario file; 0 if the keys are in a file that it extends."""
    position = loaded.position_of(*keys)
    return position.line if position.path == loaded.path else 0
