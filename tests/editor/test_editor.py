"""Tests of completion, hover texts, and errors of yaml-language-server for all keys."""

import itertools
import json
import sys
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from languageserver import Diagnostic, LanguageServer
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
NUMBERS = itertools.count()
STRANGE = "no_such_key"
WRONG, WRONG_NAMES = f"{{{STRANGE}: 1}}", "[[3]]"
"""What is right nowhere, and where there are names of the user's own."""


class Room(NamedTuple):
    """Where the words of a choice stand: `before` all of them, then for each `item` with WORD and its BODY."""

    choice: type[Choice]
    kind: str
    before: str
    item: str


ROOMS = {
    "trigger": Room(Condition, "scenario", "events:", "  - do: {cancel_goal: {}}\n    when:\n      WORD: BODY"),
    "action": Room(AnyAction, "scenario", "events:", "  - when: {time: 1 s}\n    do:\n      WORD: BODY"),
    "fault": Room(AnyFault, "scenario", "faults:", "  - sensor: lidar\n    WORD: BODY"),
    "criterion": Room(AnyCriterion, "scenario", "pass:", "  - WORD: BODY"),
    "sensor": Room(Sensor, "robot", "sensors:", "  sensor_NUMBER:\n    WORD: BODY"),
}


MAPPINGS = {kind for kind in {value.kind for value in every_value()} if isinstance(kind, type) and kind.__doc__}


class Page:
    """A file of some kind as it is typed, open in the editor."""

    def __init__(self, server: LanguageServer, kind: str, text: str) -> None:
        self.lines = [f"# yaml-language-server: $schema={SCHEMAS}/{kind}.schema.json", "simscen: 1", *text.split("\n")]
        self._server = server
        self._uri = server.open(f"typed-{next(NUMBERS)}.{kind}.yaml", "\n".join(self.lines))

    @cached_property
    def found(self) -> list[Diagnostic]:
        """What is underlined; waited for only here, so that the server has several pages to read at once."""
        return self._server.diagnostics(self._uri)

    def expected(self, line: int) -> list[tuple[str, str]]:
        """What is underlined in a line, and why."""
        return [(self.underlined(one), one.message) for one in self.found if one.line == line]

    def underlined(self, one: Diagnostic) -> str:
        return self.lines[one.line][one.begin : one.end]

    def offered(self, line: int) -> set[str]:
        """What is offered at the end of a line."""
        return set(self._server.completions(self._uri, line, len(self.lines[line])))

    def shown(self, line: int, word: str) -> str:
        """What the editor shows over a word, without marks of Markdown."""
        return plain(self._server.hover(self._uri, line, self.lines[line].index(word) + 1))


def plain(text: str) -> str:
    """Only what can be compared: Markdown escapes and breaks lines as it likes."""
    return "".join(character for character in text.replace("&nbsp;", "") if character.isalnum())


def summary(text: str) -> str:
    """The first sentence of a docstring."""
    return plain(text.split("\n\n", maxsplit=1)[0])


def words(group: str) -> list[Topic]:
    return [topic for topic in topics() if topic.group == group and topic.name in ROOMS[group].choice.choices()]


def body_of(topic: Topic) -> Any:
    """What stands behind a word in its example."""
    if not topic.example:
        return {"all": [{"time": 1}], "any": [{"time": 1}], "not": {"time": 1}}.get(topic.name, {})
    read, problems = parse_yaml(topic.example, "example")
    assert read is not None and not problems
    return next(_below(read.plain, topic.name))


def _below(value: Any, key: str) -> Iterator[Any]:
    if isinstance(value, dict):
        if key in value:
            yield value[key]
        for inner in value.values():
            yield from _below(inner, key)


def written(room: Room, lines: list[tuple[str, Any]]) -> tuple[str, list[int]]:
    """A page with these words and bodies, and the line of each word."""
    text, where = room.before, []
    for number, (word, body) in enumerate(lines):
        item = room.item.replace("NUMBER", str(number)).replace("WORD", word).replace("BODY", json.dumps(body))
        text += "\n" + item
        where.append(text.count("\n") + 2)
    return text, where


class Place(NamedTuple):
    """Where the keys of a mapping stand: a kind of file, and what is written before them, down to their indent."""

    kind: str
    before: str


STACK = "stack:\n  "
PLACES = {
    "scenario.scenario": Place("scenario", ""),
    "scenario.robot entry": Place("scenario", "robot:\n  "),
    "scenario.robots": Place("scenario", "robots:\n  left:\n    "),
    "scenario.initial_estimate": Place("scenario", "robot:\n  pose: dock\n  initial_estimate:\n    "),
    "scenario.goals": Place("scenario", "goals:\n  -\n    "),
    "scenario.expect": Place("scenario", "goals:\n  - pose: dock\n    expect:\n      "),
    "scenario.on_reached": Place("scenario", "goals:\n  - pose: dock\n    on_reached:\n      "),
    "scenario.events": Place("scenario", "events:\n  -\n    "),
    "scenario.variations": Place("scenario", "variations:\n  "),
    "scenario.sampled": Place("scenario", "variations:\n  sampled:\n    "),
    "scenario.normal": Place(
        "scenario", "variations:\n  sampled:\n    values:\n      seed:\n        normal:\n          "
    ),
    "scenario.pass_rate": Place("scenario", "acceptance:\n  pass_rate:\n    "),
    "scenario.then": Place("scenario", "events:\n  - when: {time: 1}\n    then:\n      -\n        "),
    "scenario.pose": Place("scenario", "robot:\n  pose:\n    "),
    "scenario.payload": Place("scenario", "robot:\n  pose: dock\n  payload:\n    "),
    "scenario.physics": Place("scenario", "physics:\n  "),
    "stack.stack": Place("scenario", STACK),
    "stack.speed_zones": Place("scenario", STACK + "speed_zones:\n    -\n      "),
    "stack.speed_mask": Place("scenario", STACK + "speed_mask:\n    "),
    "stack.odometry_filter": Place("scenario", STACK + "odometry:\n    "),
    "stack.external": Place("scenario", STACK + "external: mine\n  "),
    **{f"stack.{key}": Place("scenario", f"{STACK}{key}:\n    ") for key in (
        "costmap", "local_costmap", "planner", "goal_checker", "progress_checker", "recovery", "velocity_smoother",
        "collision_monitor", "prediction", "latency",
    )},
    "stack.denoise_layer": Place("scenario", STACK + "costmap:\n    denoise_layer:\n      "),
    **{
        f"stack.{each}": Place("scenario", f"{STACK}planner:\n    type: {each}\n    ")
        for each in ("navfn", "smac_2d", "medial_axis")
    },
    **{
        f"controller.{key}": Place("scenario", f"{STACK}controller:\n    type: mppi\n    {key}:\n      ")
        for key in Mppi.model_fields
        if key.endswith(("Critic", "Validator"))
    },
    "stack file.stack file": Place("stack", ""),
    "stack file.configuration": Place("config", ""),
    "stack file.stacks": Place("config", "stacks:\n  mine:\n    "),
    "world.world": Place("world", ""),
    **{f"world.{key}": Place("world", f"{key}:\n  -\n    ") for key in ("walls", "obstacles", "objects", "doors")},
    "world.ramps": Place("world", "ramps:\n  -\n    "),
    "world.move": Place("world", "objects:\n  - name: cart\n    move:\n      "),
    "robot.robot": Place("robot", ""),
    "robot.body": Place("robot", "body:\n  -\n    "),
    "robot.limits": Place("robot", "limits:\n  "),
    "robot.mount": Place("robot", "sensors:\n  front:\n    lidar:\n      mount:\n        "),
    "robot.mount of a camera": Place("robot", "sensors:\n  front:\n    camera:\n      mount:\n        "),
}  # fmt: skip
"""Where each mapping stands that is no word of a choice, by its topic."""
TYPED = {
    "localizer": Place("scenario", "stack:\n  localizer:\n    "),
    "planner": Place("scenario", "stack:\n  planner:\n    "),
    "controller": Place("scenario", "stack:\n  controller:\n    "),
    "goal_checker": Place("scenario", "stack:\n  goal_checker:\n    "),
    "behavior": Place("scenario", "stack:\n  recovery:\n    behaviors:\n      -\n        "),
    "drive": Place("robot", "drive:\n  "),
    "stack": Place("scenario", "stack:\n  "),
}
"""Where a mapping stands that is chosen by its `type`, by its group."""
NOT_TYPED_IN_OURS = {
    "world.ROS map": "a file of map_server's",
    "fault.faults": "a room",
    "criterion.pass": "a room",
    **{f"scenario.{key}": "no mapping" for key in ("uniform", "log_uniform", "integer", "choice")},
}


def places() -> Iterator[tuple[Topic, Place]]:
    """Every mapping of the language that is no word of a choice, and where it stands."""
    for topic in topics():
        name = f"{topic.group}.{topic.name}"
        if name in PLACES:
            yield topic, PLACES[name]
        elif topic.group in TYPED:
            kind, before = TYPED[topic.group]
            yield topic, Place(kind, f"{before}type: {topic.name}\n{_indent(before)}")
        elif (top := _at_the_top(topic)) is not None:
            yield topic, top
        elif name not in NOT_TYPED_IN_OURS and topic.name not in ("when", "faults", "pass"):
            assert topic.group in ROOMS, f"{name} has no place in this test"


def _at_the_top(topic: Topic) -> Place | None:
    """Where it stands if it is a key of its kind of file, alone or in a list."""
    field = (
        next((field for field in fields_of(MODELS[topic.group]) if field.key == topic.name), None)
        if (topic.group in MODELS)
        else None
    )
    if field is None:
        return None
    return Place(topic.group, f"{topic.name}:\n  -\n    " if "list of" in field.kind else f"{topic.name}:\n  ")


def _indent(before: str) -> str:
    return before.rpartition("\n")[2]


def test_completion_offers_each_key_where_it_is_valid(server: LanguageServer) -> None:
    pages = []
    for group, room in ROOMS.items():
        text, (line,) = written(room, [("WORD", "")])
        pages.append((group, room, Page(server, room.kind, text.replace('WORD: ""', "")), line))
    for group, room, page, line in pages:
        assert set(room.choice.choices()) - page.offered(line) == set(), group


def test_example_of_each_key_is_valid_and_has_a_hover_text(server: LanguageServer) -> None:
    for group, room in ROOMS.items():
        known = words(group)
        assert [topic.name for topic in known] == list(room.choice.choices())
        text, lines = written(room, [(topic.name, body_of(topic)) for topic in known])
        page = Page(server, room.kind, text)
        assert page.found == []
        for topic, line in zip(known, lines, strict=True):
            assert summary(topic.text) in page.shown(line, topic.name), topic.name


def test_editor_underlines_only_mistakes(
    server: LanguageServer,
) -> None:
    for group, room in ROOMS.items():
        known = words(group)
        mappings = [topic for topic in known if isinstance(body_of(topic), dict)]
        misspelled = [(f"{topic.name}_x", body_of(topic)) for topic in known]
        strange = [(topic.name, {STRANGE: 1, **body_of(topic)}) for topic in mappings]
        text, lines = written(room, [*misspelled, *((topic.name, True) for topic in known), *strange])
        page = Page(server, room.kind, text)
        expected = iter([page.expected(line) for line in lines])
        for topic in known:
            assert next(expected) == [(f"{topic.name}_x", f"Property {topic.name}_x is not allowed.")]
        for topic in known:
            wrong = [(underlined, why.partition(".")[0]) for underlined, why in next(expected)]
            assert wrong == [("true", "Incorrect type")], topic.name
        for _ in mappings:
            assert next(expected) == [(f'"{STRANGE}"', f"Property {STRANGE} is not allowed.")]
        assert len(page.found) == len(lines)


@pytest.mark.parametrize("group", ["trigger", "action"])
def test_choice_requires_exactly_one_key(server: LanguageServer, group: str) -> None:
    room = ROOMS[group]
    first, second = words(group)[:2]
    text, (line,) = written(room, [("WORD", 0)])
    both = f"{{{first.name}: {json.dumps(body_of(first))}, {second.name}: {json.dumps(body_of(second))}}}"
    none, two = (Page(server, room.kind, text.replace("\n      WORD: 0", f" {body}")) for body in ("{}", both))
    assert [message for _, message in none.expected(line - 1)] == [
        f"expected one of: {', '.join(room.choice.choices())}"
    ]
    assert ["only one" in message for _, message in two.expected(line - 1)] == [True]


def test_each_type_is_offered_behind_type(server: LanguageServer) -> None:
    pages = [(group, Page(server, place.kind, place.before + "type: ")) for group, place in TYPED.items()]
    for group, page in pages:
        names = {topic.name for topic in topics() if topic.group == group}
        names = {entry.name for entry in all_types(group)} if group in GROUPS else names
        assert names - page.offered(len(page.lines) - 1) == set(), group


def test_every_key_has_completion_hover_text_and_error_checks(
    server: LanguageServer,
) -> None:
    pages = []
    for topic, (kind, before) in places():
        written_before = {line.strip().partition(":")[0] for line in before.split("\n")}
        keys = [field for field in topic.fields if field.key not in written_before and field.key != "simscen"]
        wrong = [f"{field.key}: {WRONG_NAMES if field.kind.startswith('names') else WRONG}" for field in keys]
        text = before + f"\n{_indent(before)}".join([*wrong, f"{STRANGE}: 1"])
        pages.append((topic, keys, Page(server, kind, before), Page(server, kind, text)))
    mappings = [summary(topic.text) for topic in topics() if topic.text] + [
        summary(kind.__doc__) for kind in MAPPINGS if issubclass(kind, BaseModel)
    ]
    for topic, keys, empty, full in pages:
        assert {field.key for field in keys} - empty.offered(len(empty.lines) - 1) == set(), topic.name
        line = len(full.lines) - len(keys) - 1
        for number, field in enumerate(keys, start=line):
            expected = [underlined for underlined, why in full.expected(number) if not why.startswith("Missing")]
            assert full.expected(number) and {*expected} <= {WRONG, STRANGE, WRONG_NAMES}, (
                field.key,
                full.expected(number),
            )
            shown = full.shown(number, field.key)
            known = [summary(field.text), *(mappings if "mapping" in field.kind else [])]
            assert any(text in shown for text in known), (topic.name, field, shown)
        assert (STRANGE, f"Property {STRANGE} is not allowed.") in full.expected(len(full.lines) - 1), topic.name


def test_shipped_files_have_no_editor_errors(server: LanguageServer) -> None:
    shipped = [*ROOT.glob("scenarios/**/*.yaml"), *ROOT.glob("worlds/*.world.yaml"), *PACKAGE.glob("data/**/*.yaml")]
    opened = []
    for path in sorted(shipped):
        text = path.read_text(encoding="utf-8")
        kind = path.name.split(".")[-2]
        if "$schema=" not in text and kind in ("world", "robot", "scenario"):
            text = f"# yaml-language-server: $schema={SCHEMAS}/{kind}.schema.json\n{text}"
        opened.append(server.open(path.relative_to(ROOT).as_posix(), text))
    assert len(opened) > 30
    assert {uri: server.diagnostics(uri) for uri in opened if server.diagnostics(uri)} == {}
