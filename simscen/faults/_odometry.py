"""Faults that falsify increments of odometry."""

from abc import abstractmethod
from dataclasses import replace

from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.core.sensing import Odometry, Reading
from simscen.faults.base import Disturbance


class OdometryDistortion(Disturbance):
    """Falsifies each increment of odometry and adds the increments up again.

    The reported pose starts at the sensor's own, so that nothing jumps when the fault begins. When the fault is over
    the error made so far stays, as it does on a real robot; only new increments are true again.
    """

    def __init__(self) -> None:
        self._sensed: Pose2 | None = None
        self._reported: Pose2 | None = None
        self._over = False

    @abstractmethod
    def increment(self, step: Twist) -> Twist:
        """What is reported for a true increment (m, m, rad) or velocity (m/s, m/s, rad/s)."""

    def reading(self, reading: Reading) -> Reading | None:
        """The odometry with falsified increments."""
        if not isinstance(reading, Odometry):
            return reading
        if self._sensed is None or self._reported is None:
            self._sensed = self._reported = reading.pose
        step = Twist(*self._sensed.between(reading.pose))
        self._reported = self._reported.compose(Pose2(*(step if self._over else self.increment(step))))
        self._sensed = reading.pose
        return replace(
            reading, pose=self._reported, twist=reading.twist if self._over else self.increment(reading.twist)
        )

    def end(self) -> Disturbance | None:
        """The error stays."""
        self._over = True
        return self
