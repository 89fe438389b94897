"""Conditions on simulated time: `time` and `scan_age`."""

from typing import ClassVar

from simscen.core.stage import Situation
from simscen.spec.base import Spec, Value
from simscen.spec.places import Name
from simscen.spec.quantities import Duration, PositiveDuration
from simscen.triggers.base import Condition


class Time(Value[Duration], Condition):
    """True from this simulated time on.

    Example: `when: {time: 10 s}`
    """

    of_a_robot: ClassVar[bool] = False

    def holds(self, now: Situation) -> bool:
        """The clock, which counts whole ticks, has reached the tick nearest to the time."""
        return now.tick >= now.clock.ticks(self.root)


class ScanAge(Spec, Condition):
    """True while the newest scan that the stack received is older than this.

    For a second trouble that comes while a lidar is silent: somebody steps in front of a blind robot. What counts is
    simulated time since the stack received it, whenever it was measured; before the first scan, since the start.

    Example: `when: {scan_age: {above: 500 ms, sensor: lidar}}`
    """

    above: PositiveDuration
    """Seconds."""
    sensor: Name | None = None
    """The lidar, by its name in the robot's `sensors`; default: whichever spoke last."""

    def holds(self, now: Situation) -> bool:
        """Longer ago than that."""
        last = now.scanned(self.sensor)
        return now.tick - (0 if last is None else last) > now.clock.ticks(self.above)
