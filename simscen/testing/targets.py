"""Find the contracts of a component by its specification or name.

A target is a component named on the command line with --simscen-contract.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from pydantic import RootModel, ValidationError

from simscen.actions.base import Action
from simscen.criteria.base import Criterion, Measure
from simscen.faults.base import Fault
from simscen.model.controllers import GoalCheckerSpec
from simscen.model.localizers import LocalizerSpec
from simscen.model.planners import PlannerSpec
from simscen.model.recovery import BehaviorSpec
from simscen.model.sensors import SensorSpec
from simscen.model.stack_base import ControllerSpec, StackBase
from simscen.spec.registry import GROUPS, BrokenPlugin, find_type
from simscen.stack.protocols import RobotModel
from simscen.testing.contracts.actions_and_triggers import ActionContract, TriggerContract
from simscen.testing.contracts.base import Contract, Promise
from simscen.testing.contracts.behavior import BehaviorContract
from simscen.testing.contracts.controller import ControllerContract
from simscen.testing.contracts.criteria_and_metrics import CriterionContract, MetricContract
from simscen.testing.contracts.goal_checker import GoalCheckerContract
from simscen.testing.contracts.localizer import LocalizerContract
from simscen.testing.contracts.planner import PlannerContract
from simscen.testing.contracts.sensors_and_faults import FaultContract, SensorContract
from simscen.testing.contracts.stack import StackContract
from simscen.testing.flatland import box_robot, round_robot
from simscen.triggers.base import Condition

ROBOTS = {"round robot": round_robot(), "long robot": box_robot(speed=0.8)}
"""Robots by name for the contracts of planners, controllers, and behaviors."""

_CONTRACTS_PER_ROBOT: dict[type, Callable[..., Contract]] = {
    PlannerSpec: PlannerContract,
    ControllerSpec: ControllerContract,
    BehaviorSpec: BehaviorContract,
}
_CONTRACTS: dict[type, Callable[..., Contract]] = {
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
    """A target of --simscen-contract cannot be tested; the message gives the reason."""


def contracts_of(spec: Any, subject: str = "", robots: dict[str, RobotModel] | None = None) -> list[Contract]:
    """Return the contracts of the component that `spec` specifies.

    Planners, controllers, and behaviors have one contract for each robot in `robots` (robots by name, by default
    ROBOTS). `subject` is the name of the component in reports. Raises InvalidTarget if `spec` is not a specification.
    """
    for kind, contract in _CONTRACTS_PER_ROBOT.items():
        if isinstance(spec, kind):
            named_robots = (robots or ROBOTS).items()
            return [contract(spec, f"{subject} on a {name}".strip(), robot=robot) for name, robot in named_robots]
    if isinstance(spec, GoalCheckerSpec):
        return [GoalCheckerContract(spec, subject, robot=ROBOTS["round robot"])]
    for kind, contract in _CONTRACTS.items():
        if isinstance(spec, kind):
            return [contract(spec, subject)]
    raise InvalidTarget(f"{type(spec).__name__} is not a specification of one of: {', '.join(GROUPS)}")


def promises_of(spec: Any, subject: str = "", robots: dict[str, RobotModel] | None = None) -> list[Promise]:
    """Return all promises of the component that `spec` specifies. For the parameters, see `contracts_of`."""
    return [each for contract in contracts_of(spec, subject, robots) for each in contract.promises()]


def promises_of_target(target: str) -> list[Promise]:
    """Return the promises of a target of --simscen-contract. Raises InvalidTarget.

    A target is `package.module:Class` or the name of an entry point. Values of the specification can follow as JSON
    after `=`, as in `my_planner={"weight": 2}`.
    """
    component, _, values_json = target.partition("=")
    try:
        values = json.loads(values_json) if values_json else {}
    except ValueError as error:
        raise InvalidTarget(f"{target}: {values_json} is not valid JSON: {error}") from error
    specs = [_instance(spec_class, values, target) for spec_class in _specification_classes(component)]
    return [each for spec in specs for each in promises_of(spec, target if values_json else component)]


def _specification_classes(component: str) -> Sequence[Any]:
    """Return the specification class of `package.module:Class`, or the classes of all entry points with this name."""
    if ":" in component:
        module, _, name = component.partition(":")
        try:
            component_class = getattr(import_module(module), name)
        except Exception as error:  # the module of a plug-in can raise anything
            raise InvalidTarget(f"{component}: {type(error).__name__}: {error}") from error
        return [specification_of(component_class, component)]
    entries = [entry for group in GROUPS if (entry := find_type(group, component)) is not None]
    if not entries:
        raise InvalidTarget(
            f"{component}: no installed package adds anything of that name, and it is not package.module:Class"
        )
    try:
        return [entry.load() for entry in entries]
    except BrokenPlugin as broken:
        raise InvalidTarget(str(broken)) from broken


def specification_of(component_class: Any, component: str) -> Any:
    """Return the specification class of a component.

    If `component_class` is not a specification, return the annotation of its first argument. `component` is the name
    of the class in messages. Raises InvalidTarget if this annotation is not a specification either.
    """
    if not inspect.isclass(component_class):
        raise InvalidTarget(f"{component} is not a class")
    if hasattr(component_class, "model_validate"):
        return component_class
    try:
        parameter = next(iter(inspect.signature(component_class).parameters.values()), None)
        annotation = parameter.annotation if parameter else None
        # Only the first annotation is evaluated: others can be names that are imported for type checkers only.
        module_globals = getattr(component_class.__init__, "__globals__", {})
        hint = eval(annotation, module_globals) if isinstance(annotation, str) else annotation
    except Exception:  # a class without a signature, or a name that is not defined at run time
        hint = None
    if not inspect.isclass(hint) or not hasattr(hint, "model_validate"):
        raise InvalidTarget(
            f"{component}: its first argument is not annotated with a specification; give the specification instead"
        )
    return hint


def _instance(model: Any, values: Any, target: str) -> Any:
    """Return the specification of class `model` with these values. `target` is the name of the component in messages.

    Raises InvalidTarget for invalid values.
    """
    if not isinstance(values, dict) and not issubclass(model, RootModel):
        raise InvalidTarget(f"{target}: {json.dumps(values)} is not a JSON object")
    try:
        return model.model_validate(values, by_alias=True, by_name=False)
    except ValidationError as error:
        problems = "; ".join(f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors())
        example = "1.0" if issubclass(model, RootModel) else '{"key": 1}'
        hint = "" if values else f", e.g. {target}={example}"
        raise InvalidTarget(f"{target}: {model.__name__} has invalid values ({problems}){hint}") from error
    except Exception as error:  # a validator of a plug-in can raise anything
        raise InvalidTarget(f"{target}: {model.__name__}: {type(error).__name__}: {error}") from error
