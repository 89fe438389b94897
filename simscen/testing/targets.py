"""Contracts of the plug-ins that a user names."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any, get_type_hints

from pydantic import RootModel, ValidationError

from simscen.actions.base import Action
from simscen.criteria.base import Criterion, Measure
from simscen.faults.base import Fault
from simscen.model.checkers import GoalCheckerSpec
from simscen.model.localizers import LocalizerSpec
from simscen.model.planners import PlannerSpec
from simscen.model.recovery import BehaviorSpec
from simscen.model.robot import SensorSpec
from simscen.model.stack_base import ControllerSpec, StackBase
from simscen.spec.registry import GROUPS, BrokenPlugin, Entry, find
from simscen.stack.protocols import RobotModel
from simscen.testing.contracts.base import Contract, Promise
from simscen.testing.contracts.behavior import BehaviorContract
from simscen.testing.contracts.controller import ControllerContract, GoalCheckerContract
from simscen.testing.contracts.criteria_and_metrics import (
    ActionContract,
    CriterionContract,
    MetricContract,
    TriggerContract,
)
from simscen.testing.contracts.localizer import LocalizerContract
from simscen.testing.contracts.planner import PlannerContract
from simscen.testing.contracts.sensors_and_faults import FaultContract, SensorContract
from simscen.testing.contracts.stack import StackContract
from simscen.testing.flatland import box_robot, round_robot
from simscen.triggers.base import Condition

ROBOTS = {"round robot": round_robot(), "long robot": box_robot(speed=0.8)}
"""Default robots for planners, controllers and behaviors: 0.44 m wide, and 0.42 m by 0.31 m."""

_WITH_ROBOTS: dict[type, Callable[..., Contract]] = {
    PlannerSpec: PlannerContract,
    ControllerSpec: ControllerContract,
    BehaviorSpec: BehaviorContract,
}
_ALONE: dict[type, Callable[..., Contract]] = {
    LocalizerSpec: LocalizerContract,
    StackBase: StackContract,
    Criterion: CriterionContract,
    Fault: FaultContract,
    Condition: TriggerContract,
    Action: ActionContract,
    SensorSpec: SensorContract,
    Measure: MetricContract,
}


class InvalidTarget(Exception):
    """A target cannot be tested; the message gives the reason."""


def contracts_of(spec: Any, subject: str = "", robots: dict[str, RobotModel] | None = None) -> list[Contract]:
    """Return the contracts of a specification, one for each robot if the robot matters."""
    for kind, contract in _WITH_ROBOTS.items():
        if isinstance(spec, kind):
            several = (robots or ROBOTS).items()
            return [contract(spec, robot, f"{subject} on a {name}".strip()) for name, robot in several]
    if isinstance(spec, GoalCheckerSpec):
        return [GoalCheckerContract(spec, ROBOTS["round robot"], subject)]
    for kind, contract in _ALONE.items():
        if isinstance(spec, kind):
            return [contract(spec, subject=subject)]
    raise InvalidTarget(f"{type(spec).__name__} is no specification of {', '.join(GROUPS)}")


def promises_of(spec: Any, subject: str = "", robots: dict[str, RobotModel] | None = None) -> list[Promise]:
    """Return all promises of the component of a specification.

    `spec` is the specification of a planner, controller, localizer, behavior, goal checker, stack, criterion, fault,
    trigger, action, sensor or metric. `robots` are the robots for the tests by name.
    """
    return [each for contract in contracts_of(spec, subject, robots) for each in contract.promises()]


def promises_of_target(target: str) -> list[Promise]:
    """Return the promises of a target: `package.module:Class`, or the name of an entry point.

    The class is a specification, or a component whose first argument is one. Values of the specification follow as
    JSON after `=`: `my_planner={"weight": 2}`. Raises InvalidTarget.
    """
    what, _, written = target.partition("=")
    try:
        values = json.loads(written) if written else {}
    except ValueError as error:
        raise InvalidTarget(f"{target}: {written} is no JSON: {error}") from error
    return [each for model in _models(what) for each in promises_of(_instance(model, values, target), what)]


def _models(what: str) -> Sequence[Any]:
    if ":" in what:
        return [specification_of(_resolved(what), what)]
    entries = [entry for group in GROUPS if (entry := find(group, what)) is not None]
    if not entries:
        raise InvalidTarget(
            f"{what}: no installed package adds anything of that name, and it is no package.module:Class"
        )
    return [_loaded(entry) for entry in entries]


def _loaded(entry: Entry) -> Any:
    try:
        return entry.load()
    except BrokenPlugin as broken:
        raise InvalidTarget(str(broken)) from broken


def _resolved(what: str) -> Any:
    module, _, name = what.partition(":")
    try:
        return getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InvalidTarget(f"{what}: {error}") from error


def specification_of(promises_of_target: Any, what: str) -> Any:
    """Return the specification, or for a component the specification that its constructor takes."""
    if not inspect.isclass(promises_of_target):
        raise InvalidTarget(f"{what} is no class")
    if hasattr(promises_of_target, "model_validate"):
        return promises_of_target
    parameters = list(inspect.signature(promises_of_target).parameters)
    hint = get_type_hints(promises_of_target.__init__).get(parameters[0]) if parameters else None
    if not inspect.isclass(hint) or not hasattr(hint, "model_validate"):
        raise InvalidTarget(f"{what}: its first argument is not annotated with a specification, so name that one")
    return hint


def _instance(model: Any, values: Any, target: str) -> Any:
    if not isinstance(values, dict) and not issubclass(model, RootModel):
        raise InvalidTarget(f"{target}: {json.dumps(values)} is no JSON object")
    try:
        return model.model_validate(values, by_alias=True, by_name=False)
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors())
        example = "1.0" if issubclass(model, RootModel) else '{"key": 1}'
        hint = "" if values else f", e.g. {target}={example}"
        raise InvalidTarget(f"{target}: {model.__name__} needs other values ({wrong}){hint}") from error
