"""Conditions on simulated time: `time` and `scan_age`."""

from typing import ClassVar

from simscen.core.stage import Situation
from simscen.spec.base import Spec, Value
from simscen.spec.places import Name
from simscen.spec.quantities import Duration, PositiveDuration
from simscen.triggers.base import Condition


class Time(Value[Duration], Condition):
    """True from the given simulated time on.

    Example: `when: {time: 10 s}`
    """

    is_robot_specific: ClassVar[bool] = False

    def holds(self, now: Situation) -> bool:
        return now.tick >= now.clock.ticks(self.root)


class ScanAge(Spec, Condition):
    """True while the newest scan that the stack received is older than `above`.

    The age is the simulated time since the stack received the scan. Before the first scan, it is the time since the
    start of the run. Use the condition for a second disturbance while a lidar is silent.

    Example: `when: {scan_age: {above: 500 ms, sensor: lidar}}`
    """

    above: PositiveDuration
    """Age that the scan must exceed."""
    sensor: Name | None = None
    """Name of the lidar in the robot's `sensors`; default: the lidar whose scan arrived last."""

    def holds(self, now: Situation) -> bool:
        last = now.last_scan_tick(self.sensor)
        return now.tick - (0 if last is None else last) > now.clock.ticks(self.above)
