"""Interface between a robot and its stack: robot model, sensors, latencies, and the ticks of the robot's beats.

A beat is a tick at which a sensor, the stack, or a truth sample is due.
"""

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

from simscen.core.clock import Clock
from simscen.core.geometry import Pose3
from simscen.core.messages.sensor_data import Odometry, Reading, Readings
from simscen.model.robot import Ackermann, Holonomic, RobotSpec
from simscen.model.sensors import Mount, SensorSpec
from simscen.model.stack import StackSpec
from simscen.model.stack_base import Latency, StackBase
from simscen.run.preparation import PreparedScenario
from simscen.sensors.sensor import Sensor
from simscen.sim.body.robot_body import RobotBody
from simscen.stack.localizers.ground_truth import TRUTH
from simscen.stack.protocols import RobotModel


def robot_model(body: RobotBody) -> RobotModel:
    """Return the robot model (footprint and limits) that a stack receives."""
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
    """Return the class name of the readings of each sensor, such as "Scan", by sensor name."""
    truth = {TRUTH: Odometry.__name__} if prepared.stack.gets_ground_truth else {}
    return {name: sensor.reading_type for name, sensor in prepared.robot.sensors.items()} | truth


def sensor_mounts(robot: RobotSpec) -> dict[str, Pose3]:
    """Return the pose in the base frame of each sensor with a mount, by sensor name."""
    mounts = {name: getattr(sensor.chosen, "mount", None) for name, sensor in robot.sensors.items()}
    return {name: mount.pose for name, mount in mounts.items() if isinstance(mount, Mount)}


StackT = TypeVar("StackT", bound=StackBase)


def with_robot_latency(stack: StackT, robot: RobotSpec) -> StackT:
    """Return the stack, with the latencies of the robot's specification instead of `latency: robot`."""
    if not _uses_robot_latency(stack):
        return stack
    return stack.model_copy(
        update={"latency": Latency(**{part: getattr(robot.latency, part) for part in Latency.model_fields})}
    )


def sensor_latencies(prepared: PreparedScenario, clock: Clock) -> Mapping[str, int]:
    """Return the latency of each sensor in ticks, by sensor name."""
    latencies = prepared.robot.latency.sensors if _uses_robot_latency(prepared.stack) else {}
    sensors = {name: sensor.chosen for name, sensor in prepared.robot.sensors.items()}
    return {
        name: clock.ticks(latencies.get(name, sensor.latency))
        for name, sensor in sensors.items()
        if isinstance(sensor, SensorSpec)
    }


def command_latencies(prepared: PreparedScenario, clock: Clock) -> Iterator[int]:
    """Yield the delays in ticks from a control step to its commands, if the stack has latencies."""
    stack = with_robot_latency(prepared.stack, prepared.robot)
    if isinstance(stack, StackSpec) and isinstance(stack.latency, Latency):
        yield clock.ticks(stack.latency.controller)
        yield clock.ticks(stack.latency.controller) + clock.ticks(stack.latency.collision_monitor)


def _uses_robot_latency(stack: StackBase) -> bool:
    return isinstance(stack, StackSpec) and stack.latency == "robot"


class SensorSuite:
    """Sensors of a robot. A reading reaches the stack after the latency of its sensor."""

    def __init__(self, sensors: Sequence[Sensor], latencies: Mapping[str, int]) -> None:
        """`latencies` are in ticks by sensor name. Sensors that are missing in it have no latency."""
        self._sensors = tuple(sensors)
        self._latencies = [latencies.get(sensor.name, 0) for sensor in self._sensors]
        delayed: list[deque[Reading]] = [deque() for _ in self._sensors]
        self._with_latency = list(zip(self._sensors, self.periods, self._latencies, delayed, strict=True))
        self._without_latency = None if any(self._latencies) else list(zip(self._sensors, self.periods, strict=True))

    @property
    def periods(self) -> tuple[int, ...]:
        """Period of each sensor in ticks."""
        return tuple(sensor.period for sensor in self._sensors)

    @property
    def periods_and_latencies(self) -> tuple[tuple[int, int], ...]:
        """Period and latency in ticks of each sensor that has a latency."""
        pairs = zip(self.periods, self._latencies, strict=True)
        return tuple((period, latency) for period, latency in pairs if latency)

    def read(self, tick: int) -> Readings:
        """Return the readings that reach the stack at `tick`."""
        if self._without_latency is not None:
            return tuple([sensor.read(tick) for sensor, period in self._without_latency if tick % period == 0])
        readings: list[Reading] = []
        for sensor, period, latency, delayed in self._with_latency:
            if tick % period == 0:
                (delayed if latency else readings).append(sensor.read(tick))
            while delayed and delayed[0].tick + latency <= tick:
                readings.append(delayed.popleft())
        return tuple(readings)


class TickSchedule:
    """Ticks of a robot's beats: multiples of some periods, and ticks at a fixed delay after such a multiple."""

    def __init__(self, periods: Iterable[int], delayed: Iterable[tuple[int, int]] = ()) -> None:
        """`delayed` are pairs (period, delay after each multiple of this period). All numbers are in ticks."""
        series = {(period, 0) for period in periods} | {(period, ticks % period) for period, ticks in delayed}
        first, *others = sorted(each for each in series if not any(_is_covered_by(each, other) for other in series))
        (self._period, self._offset), self._others = first, others

    def ticks_until_next(self, tick: int) -> int:
        """Return the number of ticks from `tick` to the next tick of the schedule; at least 1."""
        remaining = self._period - (tick - self._offset) % self._period
        if self._others:  # most robots have a single series
            return min(remaining, *[period - (tick - ticks) % period for period, ticks in self._others])
        return remaining


def _is_covered_by(series: tuple[int, int], other: tuple[int, int]) -> bool:
    """Return whether another series contains all ticks of `series`. A series is (period, offset) in ticks."""
    (period, offset), (other_period, other_offset) = series, other
    return series != other and period % other_period == 0 and offset % other_period == other_offset
