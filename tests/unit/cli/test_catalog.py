"""Tests that each topic of the language has a description and a valid example."""

from typing import Any

import pytest
from pydantic import BaseModel, RootModel

from simscen.actions.base import AnyAction
from simscen.cli.catalog.fields import fields_of, kind_of
from simscen.cli.catalog.topics import Topic, topics
from simscen.criteria.registry import AnyCriterion
from simscen.faults.lidar_environment import Rain
from simscen.loading.yaml.parser import parse_yaml
from simscen.model.controllers import GoalCheckerSpec
from simscen.model.costmaps import Costmap
from simscen.model.disturbances import FaultEntry
from simscen.model.localizers import Amcl, LocalizerSpec
from simscen.model.planners import PlannerSpec
from simscen.model.scenario import ScenarioSpec
from simscen.model.stack import StackSpec
from simscen.model.stack_base import ControllerSpec, GoalTolerances, Latency
from simscen.spec import registry
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, Probability
from simscen.triggers import base as trigger_registry

TOPICS = topics()
WORDS = [topic for topic in TOPICS if topic.group in ("trigger", "action", "fault", "criterion") and topic.model]
SINGLE = [topic for topic in WORDS if topic.name not in ("when", "faults", "pass")]
SECTIONS = [
    topic
    for topic in TOPICS
    if topic.example and topic.group in ("scenario", "stack", "world", "robot", "drive") and topic.name != "robots"
]


def load_yaml(text: str) -> Any:
    """Return the YAML as simscen reads it, because the loader of PyYAML reads the key `off` as false."""
    tree, problems = parse_yaml(text, "example")
    assert tree is not None
    assert not problems
    return tree.plain


def _topic_id(topic: Topic) -> str:
    return f"{topic.group}.{topic.name}"


@pytest.mark.parametrize("topic", TOPICS, ids=_topic_id)
def test_every_topic_has_a_description(topic: Topic) -> None:
    first = topic.text.split("\n\n")[0]
    assert first[:1].isupper() or first.startswith("nav2_")
    assert first.rstrip().endswith((".", ":"))


@pytest.mark.parametrize("topic", SINGLE, ids=_topic_id)
def test_example_of_every_trigger_action_fault_and_criterion_is_valid(topic: Topic) -> None:
    example = load_yaml(topic.example)
    models: dict[str, tuple[type[BaseModel], str | None]] = {
        "trigger": (trigger_registry.Trigger, "when"),
        "action": (AnyAction, "do"),
        "fault": (FaultEntry, None),
        "criterion": (AnyCriterion, None),
    }
    model, key = models[topic.group]
    source = example[key] if key else example
    model.model_validate(source, by_alias=True, by_name=False)
    assert topic.name in source


@pytest.mark.parametrize("topic", SECTIONS, ids=_topic_id)
def test_example_of_every_section_is_valid(topic: Topic) -> None:
    (value,) = load_yaml(topic.example).values()
    assert topic.model is not None
    entry = value[0] if isinstance(value, list) and not issubclass(topic.model, RootModel) else value
    topic.model.model_validate(entry, by_alias=True, by_name=False)


@pytest.mark.parametrize("topic", [t for t in SINGLE if t.group == "criterion"], ids=_topic_id)
def test_every_criterion_documents_measure_failure_reason_and_source(topic: Topic) -> None:
    for heading in ("What is measured:", "When it fails:", "Why this:", "Source:"):
        assert f"\n{heading} " in topic.text


def test_type_is_described_with_unit_and_range() -> None:
    assert kind_of(Angle) == "angle in rad, -100 … 100"
    assert kind_of(Probability) == "ratio, 0 … 1"
    assert kind_of(list[Angle] | None) == "list of angles in rad, each -100 … 100"


def test_bounds_are_not_rounded() -> None:
    assert kind_of(ScenarioSpec.model_fields["seed"]) == "integer, 1 … 4294967295"
    assert kind_of(Rain.model_fields["rate"]) == "speed in m/s, > 0, ≤ 500 mm/h"


def test_defaults_are_listed_and_required_keys_have_none() -> None:
    fields = {field.key: field for field in fields_of(Amcl)}
    assert (fields["max_particles"].kind, fields["max_particles"].default) == ("integer, 10 … 50000", "2000")
    assert fields["selective_resampling"].default == "false"
    names = {field.key: field.default for field in next(t for t in TOPICS if t.name == "stopped_within").fields}
    assert names["time"] == ""


def test_modifiers_are_listed_separately_from_choices() -> None:
    assert {"edge", "delay", "times", "probability"} <= {field.key for field in fields_of(trigger_registry.Trigger)}
    assert {field.key for field in fields_of(trigger_registry.Trigger)}.isdisjoint(trigger_registry.Trigger.choices())
    assert {topic.name for topic in TOPICS if topic.group == "trigger"} == {
        *trigger_registry.AnyCondition.choices(),
        "when",
    }


def test_every_key_of_the_language_has_a_description() -> None:
    undocumented = [f"{topic.name}.{field.key}" for topic in topics() for field in topic.fields if not field.text]
    assert undocumented == []


def test_every_section_of_a_stack_and_every_shipped_component_is_a_topic() -> None:
    output = {topic.model for topic in TOPICS}
    sections = {
        field.annotation
        for model in (StackSpec, Costmap)
        for field in model.model_fields.values()
        if isinstance(field.annotation, type) and issubclass(field.annotation, Spec)
    }
    shipped = {
        entry.load()
        for group in ("localizer", "planner", "controller", "goal_checker", "behavior")
        for entry in registry.all_types(group)
    }
    bases = {LocalizerSpec, PlannerSpec, ControllerSpec, GoalCheckerSpec, GoalTolerances}
    assert (sections | shipped | {Latency}) - bases <= output
