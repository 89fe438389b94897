"""Tests of completion, hover texts, and errors of yaml-language-server for all keys."""

import itertools
import json
import sys
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from language_server import Diagnostic, LanguageServer
from pydantic import BaseModel

sys.path.insert(0, str(Path(__file__).parents[1]))
from everyfield import every_value

from simscen.actions.base import AnyAction
from simscen.cli.catalog.fields import fields_of
from simscen.cli.catalog.json_schema import MODELS
from simscen.cli.catalog.topics import Topic, topics
from simscen.core.version import PACKAGE
from simscen.criteria.registry import AnyCriterion
from simscen.faults.base import AnyFault
from simscen.loading.yaml.parser import parse_yaml
from simscen.model.mppi import Mppi
from simscen.model.sensors import Sensor
from simscen.spec.choice import Choice
from simscen.spec.registry import GROUPS, all_types
from simscen.triggers.base import AnyCondition as Condition

ROOT = Path(__file__).parents[2]
SCHEMAS = PACKAGE / "data" / "schemas"
FILE_NUMBERS = itertools.count()
UNKNOWN_KEY = "no_such_key"
WRONG_VALUE, WRONG_NAMES_VALUE = f"{{{UNKNOWN_KEY}: 1}}", "[[3]]"
"""Values that are wrong for each key: for keys with names that the user chooses, and for all other keys."""


class KeyContext(NamedTuple):
    """Text in which the keys of a choice are valid.

    choice: model whose keys are tested
    kind: kind of file
    before: text before all items
    item: text of one item, with WORD for the key and BODY for the value
    """

    choice: type[Choice]
    kind: str
    before: str
    item: str


KEY_CONTEXTS = {
    "trigger": KeyContext(Condition, "scenario", "events:", "  - do: {cancel_goal: {}}\n    when:\n      WORD: BODY"),
    "action": KeyContext(AnyAction, "scenario", "events:", "  - when: {time: 1 s}\n    do:\n      WORD: BODY"),
    "fault": KeyContext(AnyFault, "scenario", "faults:", "  - sensor: lidar\n    WORD: BODY"),
    "criterion": KeyContext(AnyCriterion, "scenario", "pass:", "  - WORD: BODY"),
    "sensor": KeyContext(Sensor, "robot", "sensors:", "  sensor_NUMBER:\n    WORD: BODY"),
}


MAPPINGS = {kind for kind in {value.kind for value in every_value()} if isinstance(kind, type) and kind.__doc__}


class OpenFile:
    """File that is open in the editor."""

    def __init__(self, server: LanguageServer, kind: str, text: str) -> None:
        self.lines = [f"# yaml-language-server: $schema={SCHEMAS}/{kind}.schema.json", "simscen: 1", *text.split("\n")]
        self._server = server
        self._uri = server.open(f"typed-{next(FILE_NUMBERS)}.{kind}.yaml", "\n".join(self.lines))

    @cached_property
    def diagnostics(self) -> list[Diagnostic]:
        """All diagnostics. They are read on first use, so that the server can check several files at once."""
        return self._server.diagnostics(self._uri)

    def underlined_in(self, line: int) -> list[tuple[str, str]]:
        """Return the underlined texts of a line with their messages."""
        return [(self._underlined_text(item), item.message) for item in self.diagnostics if item.line == line]

    def _underlined_text(self, item: Diagnostic) -> str:
        return self.lines[item.line][item.begin : item.end]

    def completions(self, line: int) -> set[str]:
        """Return the completions at the end of a line."""
        return set(self._server.completions(self._uri, line, len(self.lines[line])))

    def hover_text(self, line: int, word: str) -> str:
        """Return the comparable hover text of a word in a line."""
        return comparable_text(self._server.hover(self._uri, line, self.lines[line].index(word) + 1))


def comparable_text(text: str) -> str:
    """Return only letters and digits, because Markdown escapes characters and breaks lines."""
    return "".join(character for character in text.replace("&nbsp;", "") if character.isalnum())


def summary(text: str) -> str:
    """Return the comparable first paragraph of a text."""
    return comparable_text(text.split("\n\n", maxsplit=1)[0])


def key_topics(group: str) -> list[Topic]:
    """Return the topics of the keys of a choice, such as all triggers."""
    return [topic for topic in topics() if topic.group == group and topic.name in KEY_CONTEXTS[group].choice.choices()]


def example_value(topic: Topic) -> Any:
    """Return the value of a key in the example of its topic."""
    if not topic.example:
        return {"all": [{"time": 1}], "any": [{"time": 1}], "not": {"time": 1}}.get(topic.name, {})
    tree, problems = parse_yaml(topic.example, "example")
    assert tree is not None and not problems
    return next(_values_of(tree.plain, topic.name))


def _values_of(value: Any, key: str) -> Iterator[Any]:
    if isinstance(value, dict):
        if key in value:
            yield value[key]
        for inner in value.values():
            yield from _values_of(inner, key)


def text_with_items(context: KeyContext, lines: list[tuple[str, Any]]) -> tuple[str, list[int]]:
    """Return the text with an item for each key and value, and the line of each key."""
    text, key_lines = context.before, []
    for number, (word, body) in enumerate(lines):
        item = context.item.replace("NUMBER", str(number)).replace("WORD", word).replace("BODY", json.dumps(body))
        text += "\n" + item
        key_lines.append(text.count("\n") + 2)
    return text, key_lines


class MappingContext(NamedTuple):
    """Position of a mapping: the kind of file, and the text before its keys with their indentation."""

    kind: str
    before: str


STACK = "stack:\n  "
MAPPING_CONTEXTS = {
    "scenario.scenario": MappingContext("scenario", ""),
    "scenario.robot entry": MappingContext("scenario", "robot:\n  "),
    "scenario.robots": MappingContext("scenario", "robots:\n  left:\n    "),
    "scenario.initial_estimate": MappingContext("scenario", "robot:\n  pose: dock\n  initial_estimate:\n    "),
    "scenario.goals": MappingContext("scenario", "goals:\n  -\n    "),
    "scenario.expect": MappingContext("scenario", "goals:\n  - pose: dock\n    expect:\n      "),
    "scenario.on_reached": MappingContext("scenario", "goals:\n  - pose: dock\n    on_reached:\n      "),
    "scenario.events": MappingContext("scenario", "events:\n  -\n    "),
    "scenario.variations": MappingContext("scenario", "variations:\n  "),
    "scenario.sampled": MappingContext("scenario", "variations:\n  sampled:\n    "),
    "scenario.normal": MappingContext(
        "scenario", "variations:\n  sampled:\n    values:\n      seed:\n        normal:\n          "
    ),
    "scenario.pass_rate": MappingContext("scenario", "acceptance:\n  pass_rate:\n    "),
    "scenario.then": MappingContext("scenario", "events:\n  - when: {time: 1}\n    then:\n      -\n        "),
    "scenario.pose": MappingContext("scenario", "robot:\n  pose:\n    "),
    "scenario.payload": MappingContext("scenario", "robot:\n  pose: dock\n  payload:\n    "),
    "scenario.physics": MappingContext("scenario", "physics:\n  "),
    "stack.stack": MappingContext("scenario", STACK),
    "stack.speed_zones": MappingContext("scenario", STACK + "speed_zones:\n    -\n      "),
    "stack.speed_mask": MappingContext("scenario", STACK + "speed_mask:\n    "),
    "stack.odometry_filter": MappingContext("scenario", STACK + "odometry:\n    "),
    "stack.external": MappingContext("scenario", STACK + "external: mine\n  "),
    **{f"stack.{key}": MappingContext("scenario", f"{STACK}{key}:\n    ") for key in (
        "costmap", "local_costmap", "planner", "goal_checker", "progress_checker", "recovery", "velocity_smoother",
        "collision_monitor", "prediction", "latency",
    )},
    "stack.denoise_layer": MappingContext("scenario", STACK + "costmap:\n    denoise_layer:\n      "),
    **{
        f"stack.{planner}": MappingContext("scenario", f"{STACK}planner:\n    type: {planner}\n    ")
        for planner in ("navfn", "smac_2d", "medial_axis")
    },
    **{
        f"controller.{key}": MappingContext("scenario", f"{STACK}controller:\n    type: mppi\n    {key}:\n      ")
        for key in Mppi.model_fields
        if key.endswith(("Critic", "Validator"))
    },
    "stack file.stack file": MappingContext("stack", ""),
    "stack file.configuration": MappingContext("config", ""),
    "stack file.stacks": MappingContext("config", "stacks:\n  mine:\n    "),
    "world.world": MappingContext("world", ""),
    **{
        f"world.{key}": MappingContext("world", f"{key}:\n  -\n    ")
        for key in ("walls", "obstacles", "objects", "doors")
    },
    "world.ramps": MappingContext("world", "ramps:\n  -\n    "),
    "world.move": MappingContext("world", "objects:\n  - name: cart\n    move:\n      "),
    "robot.robot": MappingContext("robot", ""),
    "robot.body": MappingContext("robot", "body:\n  -\n    "),
    "robot.limits": MappingContext("robot", "limits:\n  "),
    "robot.mount": MappingContext("robot", "sensors:\n  front:\n    lidar:\n      mount:\n        "),
    "robot.mount of a camera": MappingContext("robot", "sensors:\n  front:\n    camera:\n      mount:\n        "),
}  # fmt: skip
"""Position of each mapping that is not the value of a key of KEY_CONTEXTS, by topic."""
TYPE_CONTEXTS = {
    "localizer": MappingContext("scenario", "stack:\n  localizer:\n    "),
    "planner": MappingContext("scenario", "stack:\n  planner:\n    "),
    "controller": MappingContext("scenario", "stack:\n  controller:\n    "),
    "goal_checker": MappingContext("scenario", "stack:\n  goal_checker:\n    "),
    "behavior": MappingContext("scenario", "stack:\n  recovery:\n    behaviors:\n      -\n        "),
    "drive": MappingContext("robot", "drive:\n  "),
    "stack": MappingContext("scenario", "stack:\n  "),
}
"""Position of each mapping with a key `type`, by group of topics."""
OTHER_TOPICS = {
    "world.ROS map": "a file of map_server",
    "fault.faults": "in KEY_CONTEXTS",
    "criterion.pass": "in KEY_CONTEXTS",
    **{f"scenario.{key}": "not a mapping" for key in ("uniform", "log_uniform", "integer", "choice")},
}
"""Topics without a position in this test, with the reason."""


def mapping_contexts() -> Iterator[tuple[Topic, MappingContext]]:
    """Yield each mapping that is not the value of a key of KEY_CONTEXTS, with its position."""
    for topic in topics():
        name = f"{topic.group}.{topic.name}"
        if name in MAPPING_CONTEXTS:
            yield topic, MAPPING_CONTEXTS[name]
        elif topic.group in TYPE_CONTEXTS:
            kind, before = TYPE_CONTEXTS[topic.group]
            yield topic, MappingContext(kind, f"{before}type: {topic.name}\n{_indent(before)}")
        elif (top_level := _top_level_context(topic)) is not None:
            yield topic, top_level
        elif name not in OTHER_TOPICS and topic.name not in ("when", "faults", "pass"):
            assert topic.group in KEY_CONTEXTS, f"{name} has no position in this test"


def _top_level_context(topic: Topic) -> MappingContext | None:
    """Return the position of a top-level key of a file whose value is a mapping or a list of mappings."""
    field = (
        next((field for field in fields_of(MODELS[topic.group]) if field.key == topic.name), None)
        if (topic.group in MODELS)
        else None
    )
    if field is None:
        return None
    return MappingContext(topic.group, f"{topic.name}:\n  -\n    " if "list of" in field.kind else f"{topic.name}:\n  ")


def _indent(before: str) -> str:
    return before.rpartition("\n")[2]


def test_completion_offers_each_key_where_it_is_valid(server: LanguageServer) -> None:
    files = []
    for group, context in KEY_CONTEXTS.items():
        text, (line,) = text_with_items(context, [("WORD", "")])
        files.append((group, context, OpenFile(server, context.kind, text.replace('WORD: ""', "")), line))
    for group, context, file, line in files:
        assert set(context.choice.choices()) - file.completions(line) == set(), group


def test_example_of_each_key_is_valid_and_has_a_hover_text(server: LanguageServer) -> None:
    for group, context in KEY_CONTEXTS.items():
        tested_topics = key_topics(group)
        assert [topic.name for topic in tested_topics] == list(context.choice.choices())
        text, lines = text_with_items(context, [(topic.name, example_value(topic)) for topic in tested_topics])
        file = OpenFile(server, context.kind, text)
        assert file.diagnostics == []
        for topic, line in zip(tested_topics, lines, strict=True):
            assert summary(topic.text) in file.hover_text(line, topic.name), topic.name


def test_editor_underlines_only_mistakes(
    server: LanguageServer,
) -> None:
    for group, context in KEY_CONTEXTS.items():
        tested_topics = key_topics(group)
        mappings = [topic for topic in tested_topics if isinstance(example_value(topic), dict)]
        misspelled = [(f"{topic.name}_x", example_value(topic)) for topic in tested_topics]
        with_unknown_key = [(topic.name, {UNKNOWN_KEY: 1, **example_value(topic)}) for topic in mappings]
        text, lines = text_with_items(
            context, [*misspelled, *((topic.name, True) for topic in tested_topics), *with_unknown_key]
        )
        file = OpenFile(server, context.kind, text)
        expected = iter([file.underlined_in(line) for line in lines])
        for topic in tested_topics:
            assert next(expected) == [(f"{topic.name}_x", f"Property {topic.name}_x is not allowed.")]
        for topic in tested_topics:
            wrong = [(underlined, message.partition(".")[0]) for underlined, message in next(expected)]
            assert wrong == [("true", "Incorrect type")], topic.name
        for _ in mappings:
            assert next(expected) == [(f'"{UNKNOWN_KEY}"', f"Property {UNKNOWN_KEY} is not allowed.")]
        assert len(file.diagnostics) == len(lines)


@pytest.mark.parametrize("group", ["trigger", "action"])
def test_choice_requires_exactly_one_key(server: LanguageServer, group: str) -> None:
    context = KEY_CONTEXTS[group]
    first, second = key_topics(group)[:2]
    text, (line,) = text_with_items(context, [("WORD", 0)])
    two_keys = (
        f"{{{first.name}: {json.dumps(example_value(first))}, {second.name}: {json.dumps(example_value(second))}}}"
    )
    without_key, with_two_keys = (
        OpenFile(server, context.kind, text.replace("\n      WORD: 0", f" {body}")) for body in ("{}", two_keys)
    )
    assert [message for _, message in without_key.underlined_in(line - 1)] == [
        f"expected one of: {', '.join(context.choice.choices())}"
    ]
    assert ["only one" in message for _, message in with_two_keys.underlined_in(line - 1)] == [True]


def test_key_type_has_all_types_as_completions(server: LanguageServer) -> None:
    files = [
        (group, OpenFile(server, context.kind, context.before + "type: ")) for group, context in TYPE_CONTEXTS.items()
    ]
    for group, file in files:
        names = {topic.name for topic in topics() if topic.group == group}
        names = {entry.name for entry in all_types(group)} if group in GROUPS else names
        assert names - file.completions(len(file.lines) - 1) == set(), group


def test_every_key_has_completion_hover_text_and_error_checks(
    server: LanguageServer,
) -> None:
    files = []
    for topic, (kind, before) in mapping_contexts():
        written_before = {line.strip().partition(":")[0] for line in before.split("\n")}
        keys = [field for field in topic.fields if field.key not in written_before and field.key != "simscen"]
        wrong = [
            f"{field.key}: {WRONG_NAMES_VALUE if field.kind.startswith('names') else WRONG_VALUE}" for field in keys
        ]
        text = before + f"\n{_indent(before)}".join([*wrong, f"{UNKNOWN_KEY}: 1"])
        files.append((topic, keys, OpenFile(server, kind, before), OpenFile(server, kind, text)))
    mappings = [summary(topic.text) for topic in topics() if topic.text] + [
        summary(kind.__doc__) for kind in MAPPINGS if issubclass(kind, BaseModel)
    ]
    for topic, keys, empty, full in files:
        assert {field.key for field in keys} - empty.completions(len(empty.lines) - 1) == set(), topic.name
        line = len(full.lines) - len(keys) - 1
        for number, field in enumerate(keys, start=line):
            expected = [
                underlined for underlined, message in full.underlined_in(number) if not message.startswith("Missing")
            ]
            assert full.underlined_in(number) and {*expected} <= {WRONG_VALUE, UNKNOWN_KEY, WRONG_NAMES_VALUE}, (
                field.key,
                full.underlined_in(number),
            )
            hover_text = full.hover_text(number, field.key)
            valid_texts = [summary(field.text), *(mappings if "mapping" in field.kind else [])]
            assert any(text in hover_text for text in valid_texts), (topic.name, field, hover_text)
        assert (UNKNOWN_KEY, f"Property {UNKNOWN_KEY} is not allowed.") in full.underlined_in(len(full.lines) - 1), (
            topic.name
        )


def test_shipped_files_have_no_editor_errors(server: LanguageServer) -> None:
    shipped = [*ROOT.glob("scenarios/**/*.yaml"), *ROOT.glob("worlds/*.world.yaml"), *PACKAGE.glob("data/**/*.yaml")]
    uris = []
    for path in sorted(shipped):
        text = path.read_text(encoding="utf-8")
        kind = path.name.split(".")[-2]
        if "$schema=" not in text and kind in ("world", "robot", "scenario"):
            text = f"# yaml-language-server: $schema={SCHEMAS}/{kind}.schema.json\n{text}"
        uris.append(server.open(path.relative_to(ROOT).as_posix(), text))
    assert len(uris) > 30
    assert {uri: server.diagnostics(uri) for uri in uris if server.diagnostics(uri)} == {}
