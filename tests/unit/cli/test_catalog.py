"""Every word of the language is documented, and its example is valid."""

from importlib import import_module
from typing import Any

import pytest
from pydantic import BaseModel

from simscen.actions.registry import AnyAction
from simscen.cli.catalog.topics import Topic, fields_of, kind_of, topics
from simscen.criteria.registry import AnyCriterion
from simscen.loading.yaml.parser import parse_yaml
from simscen.model.checkers import GoalCheckerSpec
from simscen.model.costmaps import Costmap
from simscen.model.disturbances import FaultEntry
from simscen.model.latency import Latency
from simscen.model.localizers import Amcl, LocalizerSpec
from simscen.model.planners import PlannerSpec
from simscen.model.stack import StackSpec
from simscen.model.stack_base import ControllerSpec, GoalTolerances
from simscen.spec import registry
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, Probability
from simscen.triggers import registry as trigger_registry

TOPICS = topics()
WORDS = [topic for topic in TOPICS if topic.group in ("trigger", "action", "fault", "criterion") and topic.model]
SINGLE = [topic for topic in WORDS if topic.name not in ("when", "faults", "pass")]


def plain(text: str) -> Any:
    """As simscen reads it: PyYAML's own loader takes the key `off` for false."""
    tree, problems = parse_yaml(text, "example")
    assert tree is not None
    assert not problems
    return tree.plain


def _id(topic: Topic) -> str:
    return f"{topic.group}.{topic.name}"


@pytest.mark.parametrize("topic", TOPICS, ids=_id)
def test_everything_is_described_in_a_sentence(topic: Topic) -> None:
    first = topic.text.split("\n\n")[0]
    assert first[:1].isupper() or first.startswith("nav2_")
    assert first.rstrip().endswith((".", ":"))


@pytest.mark.parametrize("topic", WORDS, ids=_id)
def test_every_key_of_a_word_is_described(topic: Topic) -> None:
    assert [field.key for field in topic.fields if not field.text] == []


@pytest.mark.parametrize("topic", SINGLE, ids=_id)
def test_every_word_has_an_example_that_is_valid_and_about_it(topic: Topic) -> None:
    example = plain(topic.example)
    models: dict[str, tuple[type[BaseModel], str | None]] = {
        "trigger": (trigger_registry.Trigger, "when"),
        "action": (AnyAction, "do"),
        "fault": (FaultEntry, None),
        "criterion": (AnyCriterion, None),
    }
    model, key = models[topic.group]
    written = example[key] if key else example
    model.model_validate(written, by_alias=True, by_name=False)
    assert topic.name in written


@pytest.mark.parametrize("topic", [t for t in SINGLE if t.group == "criterion"], ids=_id)
def test_every_criterion_tells_what_when_why_and_whence(topic: Topic) -> None:
    for heading in ("What is measured:", "When it fails:", "Why this:", "Source:"):
        assert f"\n{heading} " in topic.text


def test_a_type_is_told_with_unit_and_range() -> None:
    assert kind_of(Angle) == "angle in rad, -100 … 100"
    assert kind_of(Probability) == "ratio, 0 … 1"
    assert kind_of(list[Angle] | None) == "list of angle in rad, -100 … 100"


def test_defaults_are_told_and_what_is_required_has_none() -> None:
    fields = {field.key: field for field in fields_of(Amcl)}
    assert (fields["max_particles"].kind, fields["max_particles"].default) == ("integer, 10 … 50000", "2000")
    assert fields["selective_resampling"].default == "false"
    names = {field.key: field.default for field in next(t for t in TOPICS if t.name == "stopped_within").fields}
    assert names["time"] == ""


def test_modifiers_are_listed_apart_from_the_choices() -> None:
    assert {"edge", "delay", "times", "probability"} <= {field.key for field in fields_of(trigger_registry.Trigger)}
    assert {field.key for field in fields_of(trigger_registry.Trigger)}.isdisjoint(trigger_registry.Trigger.choices())
    assert {topic.name for topic in TOPICS if topic.group == "trigger"} == {
        *trigger_registry.AnyCondition.choices(),
        "when",
    }


def test_every_key_of_the_language_says_what_it_means() -> None:
    silent = [f"{topic.name}.{field.key}" for topic in topics() for field in topic.fields if not field.text]
    assert silent == []


def test_every_section_of_a_stack_and_every_shipped_component_is_a_topic() -> None:
    told = {topic.model for topic in TOPICS}
    sections = {
        field.annotation
        for model in (StackSpec, Costmap)
        for field in model.model_fields.values()
        if isinstance(field.annotation, type) and issubclass(field.annotation, Spec)
    }
    shipped = {
        getattr(import_module(module), name)
        for group in ("localizer", "planner", "controller", "goal_checker", "behavior")
        for module, name in (entry.value.split(":") for entry in registry.shipped(group))
    }
    bases = {LocalizerSpec, PlannerSpec, ControllerSpec, GoalCheckerSpec, GoalTolerances}
    assert (sections | shipped | {Latency}) - bases <= told
