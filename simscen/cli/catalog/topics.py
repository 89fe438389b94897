"""Topics of the scenario language for `simscen explain` and the language reference.

A topic is a part of the language, such as a criterion or a fault. Its text is the docstring of its pydantic model. A
Choice is a model of a mapping with exactly one main key, such as the kind of a trigger, and optional modifiers.
"""

import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import NoneType
from typing import get_args

from pydantic import BaseModel, RootModel

from simscen.actions.base import AnyAction
from simscen.cli.catalog.examples import EXAMPLES
from simscen.cli.catalog.fields import Field, fields_of, kind_of
from simscen.criteria import error_codes
from simscen.criteria.registry import AnyCriterion
from simscen.faults.base import AnyFault
from simscen.model import (
    acceptance,
    controllers,
    costmaps,
    localizers,
    mppi,
    navigation,
    planners,
    recovery,
    robot,
    scenario,
    sensors,
    stack,
    stack_base,
    stack_files,
    variations,
    velocity_commands,
    world,
)
from simscen.model.disturbances import EventEntry, FaultEntry, StepEntry
from simscen.model.stack_base import SpeedZone
from simscen.model.world import RosMapSpec
from simscen.spec import registry
from simscen.spec.base import annotation_of, field_docs
from simscen.spec.choice import Choice
from simscen.spec.places import PoseSpec, SpeedMask
from simscen.triggers.base import AnyCondition, Trigger

HEADINGS = ("What is measured:", "When it fails:", "Why this:", "Source:")
"""Headings in the docstring of a criterion."""
_EXAMPLE = re.compile(r"^Example: `(.+)`$", re.MULTILINE)


@dataclass(frozen=True)
class Topic:
    """Part of the scenario language with its explanation.

    group:    kind of the part, such as "trigger"
    name:     name of the part, such as "stopped_within"
    model:    pydantic model of its value; None without a model
    text:     description
    example:  YAML text; "" without an example
    rows:     keys to list; () for the keys of `model`
    origin:   package that adds the topic, with its version; "" for topics of simscen
    alias:    other name, such as the number of an error code; "" without another name
    """

    group: str
    name: str
    model: type[BaseModel] | None
    text: str
    example: str = ""
    rows: tuple[Field, ...] = ()
    origin: str = ""
    alias: str = ""

    @property
    def fields(self) -> list[Field]:
        """Keys of the value in the order of the model; empty if the value is not a mapping."""
        if self.rows:
            return list(self.rows)
        return fields_of(self.model) if self.model is not None and not issubclass(self.model, RootModel) else []

    @property
    def value(self) -> str:
        """Kind of the value, such as "text"; "" if the value is a mapping or the topic has no model."""
        if self.model is not None and issubclass(self.model, RootModel):
            return kind_of(self.model)
        return ""


def topics(with_plugins: bool = False) -> list[Topic]:
    """Return the topics of the scenario language in order. `with_plugins` adds the topics of installed packages."""
    return [
        *_choices(AnyCondition, with_plugins),
        _topic("trigger", "when", Trigger),
        *_choices(AnyAction, with_plugins),
        *_choices(AnyFault, with_plugins),
        _topic("fault", "faults", FaultEntry),
        *_choices(AnyCriterion, with_plugins),
        _topic("criterion", "pass", AnyCriterion),
        *_models("scenario", _SCENARIO),
        *_models("stack", _STACK),
        *entry_point_topics("stack", with_plugins),
        *_models("stack file", _STACK_FILES),
        *_models("localizer", registry.built_in_specs("localizer")),
        *entry_point_topics("localizer", with_plugins),
        *_models("planner", _PLANNERS),
        *entry_point_topics("planner", with_plugins),
        *_models("controller", registry.built_in_specs("controller")),
        *_models("controller", _MPPI_SECTIONS),
        *entry_point_topics("controller", with_plugins),
        *_models("behavior", registry.built_in_specs("behavior")),
        *entry_point_topics("behavior", with_plugins),
        *entry_point_topics("goal_checker", with_plugins),
        *_models("world", _WORLD),
        *_models("robot", _ROBOT),
        *_models("drive", _DRIVES),
        *_choices(sensors.Sensor, with_plugins),
    ]


# Models by name of the topic, for each group of topics that is not a Choice.
_SCENARIO: dict[str, type[BaseModel]] = {
    "scenario": scenario.ScenarioSpec,
    "robot entry": scenario.RobotEntry,
    "robots": scenario.MultiRobotEntry,
    "initial_estimate": scenario.InitialEstimate,
    "payload": scenario.Payload,
    "goals": scenario.GoalEntry,
    "navigation": navigation.Navigation,
    "expect": error_codes.ExpectedError,
    "on_reached": navigation.OnReached,
    "events": EventEntry,
    "then": StepEntry,
    "pose": PoseSpec,
    "physics": scenario.Physics,
    "expected": scenario.ExpectedFailure,
    "variations": variations.VariationBlock,
    "sampled": variations.Sampled,
    "uniform": variations.Uniform,
    "log_uniform": variations.LogUniform,
    "normal": variations.Normal,
    "integer": variations.Integer,
    "choice": variations.OneOf,
    "acceptance": acceptance.Acceptance,
    "pass_rate": acceptance.PassRate,
}
_STACK: dict[str, type[BaseModel]] = {
    "stack": stack.StackSpec,
    "external": stack_files.ExternalStackSpec,
    "speed_zones": SpeedZone,
    "speed_mask": SpeedMask,
    "odometry_filter": localizers.OdometryFilter,
    "costmap": costmaps.Costmap,
    "local_costmap": costmaps.LocalCostmap,
    "goal_checker": controllers.SimpleGoalChecker,
    "progress_checker": controllers.ProgressChecker,
    "recovery": recovery.Recovery,
    "velocity_smoother": velocity_commands.VelocitySmoother,
    "collision_monitor": velocity_commands.CollisionMonitor,
    "prediction": costmaps.Prediction,
    "denoise_layer": costmaps.DenoiseLayer,
    "latency": stack_base.Latency,
}
_PLANNERS: dict[str, type[BaseModel]] = {
    "planner": planners.OmplPlanner,
    "navfn": planners.Navfn,
    "smac_2d": planners.Smac2d,
}
_MPPI_SECTIONS: dict[str, type[BaseModel]] = {
    name: annotation_of(field) for name, field in mppi.Mppi.model_fields.items() if name[0].isupper()
}
"""Models of the keys of `mppi` that are mappings: its critics and its validator."""
_STACK_FILES: dict[str, type[BaseModel]] = {
    "stack file": stack_files.StackFileSpec,
    "configuration": stack_files.UserConfigSpec,
    "stacks": stack_files.StackCommandSpec,
}
_WORLD: dict[str, type[BaseModel]] = {
    "world": world.WorldSpec,
    "walls": world.Wall,
    "obstacles": world.Obstacle,
    "ramps": world.Ramp,
    "objects": world.Movable,
    "move": world.Travel,
    "doors": world.Door,
    "ROS map": RosMapSpec,
}
_ROBOT: dict[str, type[BaseModel]] = {
    "robot": robot.RobotSpec,
    "body": robot.Part,
    "limits": robot.Limits,
    "mount": sensors.Mount,
}
_DRIVES: dict[str, type[BaseModel]] = {
    get_args(model.model_fields["type"].annotation)[0]: model for model in get_args(get_args(robot.Drive)[0])
}


def _models(group: str, models: Mapping[str, type[BaseModel]]) -> Iterator[Topic]:
    return (_topic(group, name, model) for name, model in models.items())


def _choices(choice: type[Choice], with_plugins: bool) -> Iterator[Topic]:
    """Yield a topic for each main key of a Choice, including the keys of installed packages if `with_plugins`."""
    group = choice.group
    docs = field_docs(choice)
    for key, name in choice.choices().items():
        kind = annotation_of(choice.model_fields[name])
        models = [m for m in get_args(kind) or (kind,) if isinstance(m, type) and m is not NoneType]
        model = models[0] if models and issubclass(models[0], BaseModel) and models[0] is not choice else None
        if model is not None:
            yield _topic(group, key, model)
        else:
            yield Topic(group, key, None, docs.get(name, ""), EXAMPLES.get(f"{group}.{key}", ""))
    yield from entry_point_topics(group, with_plugins)


def entry_point_topics(group: str, with_plugins: bool) -> Iterator[Topic]:
    """Yield the topics of the types that simscen registers as entry points, or any package if `with_plugins`."""
    origins = {entry.name: entry.origin for entry in registry.plugin_types(group)}
    for name, model in registry.installed_specs(group, with_plugins=with_plugins).items():
        yield replace(_topic(group, name, model), origin=origins.get(name, ""))


def _topic(group: str, name: str, model: type[BaseModel]) -> Topic:
    """Return the topic of a model, from its docstring. A line "Example: …" becomes the example."""
    text = inspect.cleandoc(model.__doc__ or "")
    example = _EXAMPLE.search(text)
    example_text = example[1] if example else EXAMPLES.get(f"{group}.{name}", "")
    return Topic(group, name, model, _EXAMPLE.sub("", text).strip(), example_text)
