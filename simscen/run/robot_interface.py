"""Properties of a robot that stacks and logs need: its model, its sensors, and its latencies."""

import math
from collections.abc import Iterator, Mapping
from typing import TypeVar

from simscen.core.clock import Clock
from simscen.core.geometry import Pose3
from simscen.core.messages.sensor_data import Odometry
from simscen.model.latency import Latency
from simscen.model.robot import Ackermann, Holonomic, Mount, RobotSpec, SensorSpec
from simscen.model.stack import StackSpec
from simscen.model.stackbase import StackBase
from simscen.run.preparation.scenario import PreparedScenario
from simscen.sim.robot_body import RobotBody
from simscen.stack.localizers.ground_truth import TRUTH
from simscen.stack.protocols import RobotModel


def robot_model(body: RobotBody) -> RobotModel:
    """Return the robot model that a stack receives."""
    limits, drive = body.limits, body.drive
    holonomic = isinstance(drive, Holonomic)
    return RobotModel(
        footprint=body.footprint,
        radius=body.radius,
        max_linear=limits.linear,
        max_reverse=limits.reverse or limits.linear,
        max_lateral=(limits.lateral or limits.linear) if holonomic else 0.0,
        max_angular=limits.angular,
        linear_acceleration=limits.linear_acceleration,
        linear_deceleration=limits.linear_deceleration or limits.linear_acceleration,
        angular_acceleration=limits.angular_acceleration,
        turning_radius=drive.wheel_base / math.tan(drive.max_steering) if isinstance(drive, Ackermann) else 0.0,
        holonomic=holonomic,
    )


def sensor_kinds(prepared: PreparedScenario) -> dict[str, str]:
    """Return the type of readings of each sensor by name, in the order in which they are read."""
    told = {TRUTH: Odometry.__name__} if prepared.stack.told_truth else {}
    return {name: sensor.says for name, sensor in prepared.robot.sensors.items()} | told


def sensor_frames(robot: RobotSpec) -> dict[str, Pose3]:
    """Return the mount pose of each sensor that has one, relative to the base."""
    mounts = {name: getattr(sensor.chosen, "mount", None) for name, sensor in robot.sensors.items()}
    return {name: mount.pose for name, mount in mounts.items() if isinstance(mount, Mount)}


AnyStack = TypeVar("AnyStack", bound=StackBase)


def with_robot_latency(stack: AnyStack, robot: RobotSpec) -> AnyStack:
    """Return the stack with `latency: robot` replaced by the latencies in the robot's file."""
    if not _as_robot(stack):
        return stack
    return stack.model_copy(
        update={"latency": Latency(**{part: getattr(robot.latency, part) for part in Latency.model_fields})}
    )


def sensor_latencies(prepared: PreparedScenario, clock: Clock) -> Mapping[str, int]:
    """Return the latency of each sensor in ticks, by name."""
    usual = prepared.robot.latency.sensors if _as_robot(prepared.stack) else {}
    own = {name: sensor.chosen for name, sensor in prepared.robot.sensors.items()}
    return {
        name: clock.ticks(usual.get(name, sensor.latency))
        for name, sensor in own.items()
        if isinstance(sensor, SensorSpec)
    }


def command_latencies(prepared: PreparedScenario, clock: Clock) -> Iterator[int]:
    """Yield the delays in ticks from a control step to the resulting commands."""
    stack = with_robot_latency(prepared.stack, prepared.robot)
    if isinstance(stack, StackSpec) and isinstance(stack.latency, Latency):
        yield clock.ticks(stack.latency.controller)
        yield clock.ticks(stack.latency.controller) + clock.ticks(stack.latency.collision_monitor)


def _as_robot(stack: StackBase) -> bool:
    return isinstance(stack, StackSpec) and stack.latency == "robot"
