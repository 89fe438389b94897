"""Contract tests of all shipped criteria, faults, triggers, and actions."""

import re
from collections.abc import Iterator

import pytest
import yaml

from simscen.actions.base import AnyAction
from simscen.criteria.registry import AnyCriterion
from simscen.faults.base import AnyFault
from simscen.model.sensors import Bumper, Camera, InertialUnit, Lidar, WheelOdometry
from simscen.spec.base import annotation_of
from simscen.spec.choice import Choice
from simscen.testing import Promise, promises_of
from simscen.testing.targets import promises_of_target
from simscen.triggers.base import Trigger


def examples(choice: type[Choice], key_of_choice: str = "", skipped: tuple[str, ...] = ()) -> Iterator[Promise]:
    """Yield the promises of the docstring example of each type; the type is below `key_of_choice` in the example."""
    for key, field in choice.choices().items():
        if key not in skipped:
            text = re.search(r"Example: `(.+)`", annotation_of(choice.model_fields[field]).__doc__ or "")
            assert text, key
            fields = yaml.safe_load(text[1])
            fields = {
                "off" if name is False else name: value for name, value in fields.get(key_of_choice, fields).items()
            }
            chosen = {name: value for name, value in fields.items() if name in {*choice.choices(), *choice.modifiers}}
            yield from promises_of(choice.model_validate(chosen).chosen, key)


PROMISES = [
    *examples(AnyCriterion),
    *examples(AnyFault),
    *examples(Trigger, "when", ("all", "any", "not")),
    *examples(AnyAction, "do"),
]


@pytest.mark.parametrize("promise", PROMISES, ids=str)
def test_component_meets_its_contract(promise: Promise) -> None:
    promise.check()


SENSORS = {"lidar": Lidar(), "odometry": WheelOdometry(), "imu": InertialUnit(), "bumper": Bumper(), "camera": Camera()}


@pytest.mark.parametrize("promise", [p for name, spec in SENSORS.items() for p in promises_of(spec, name)], ids=str)
def test_sensor_meets_its_contract(promise: Promise) -> None:
    promise.check()


NAMES = ['dwell={"region": "dock", "max": 5.0}', "crosstalk", 'turn_robot={"by": 1.0}', "sonar", "reversed_length"]


@pytest.mark.parametrize("name", NAMES)
def test_types_of_a_package_meet_their_contracts(yardwork, name: str) -> None:
    for promise in promises_of_target(name):
        promise.check()
