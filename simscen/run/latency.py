"""How late readings and commands are, by the files of the robot and of its stack."""

from collections.abc import Iterator, Mapping
from typing import TypeVar

from simscen.core.clock import Clock
from simscen.model.latency import Latency
from simscen.model.robot import RobotSpec, SensorSpec
from simscen.model.stack import StackSpec
from simscen.model.stackbase import StackBase
from simscen.run.prepare import Prepared

AnyStack = TypeVar("AnyStack", bound=StackBase)


def with_latency(stack: AnyStack, robot: RobotSpec) -> AnyStack:
    """The stack, with the durations of the robot's file in place of `latency: robot`."""
    if not _as_robot(stack):
        return stack
    return stack.model_copy(
        update={"latency": Latency(**{part: getattr(robot.latency, part) for part in Latency.model_fields})}
    )


def sensor_latencies(prepared: Prepared, clock: Clock) -> Mapping[str, int]:
    """Ticks from a reading to the stack, by the sensor's name: what it says itself, or what is usual on the robot."""
    usual = prepared.robot.latency.sensors if _as_robot(prepared.stack) else {}
    own = {name: sensor.chosen for name, sensor in prepared.robot.sensors.items()}
    return {
        name: clock.ticks(usual.get(name, sensor.latency))
        for name, sensor in own.items()
        if isinstance(sensor, SensorSpec)
    }


def command_latencies(prepared: Prepared, clock: Clock) -> Iterator[int]:
    """Ticks after each question to the controller at which something comes of it."""
    stack = with_latency(prepared.stack, prepared.robot)
    if isinstance(stack, StackSpec) and isinstance(stack.latency, Latency):
        yield clock.ticks(stack.latency.controller)
        yield clock.ticks(stack.latency.controller) + clock.ticks(stack.latency.collision_monitor)


def _as_robot(stack: StackBase) -> bool:
    return isinstance(stack, StackSpec) and stack.latency == "robot"
