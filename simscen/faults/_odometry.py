"""Faults that falsify increments of odometry."""

from abc import abstractmethod
from dataclasses import replace

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry, Reading
from simscen.faults.base import Disturbance


class OdometryDistortion(Disturbance):
    """Falsifies each increment of odometry and adds the increments up again.

    The reported pose starts at the sensor's own, so that nothing jumps when the fault begins. When the fault is over
    the error made so far stays, as it does on a real robot; only new increments are true again. Of several sensors
    each has its own sum.
    """

    def __init__(self) -> None:
        self._sums: dict[str, tuple[Odometry, Pose2]] = {}
        self._over = False

    @abstractmethod
    def increment(self, step: Twist) -> Twist:
        """What is reported for a true increment (m, m, rad) or velocity (m/s, m/s, rad/s)."""

    def reported(self, step: Twist, twist: Twist, ticks: int) -> tuple[Twist, Twist]:
        """What is reported for an increment over some ticks, and for the velocity at its end."""
        return self.increment(step), self.increment(twist)

    def reading(self, reading: Reading) -> Reading | None:
        """The odometry with falsified increments."""
        if not isinstance(reading, Odometry):
            return reading
        before, pose = self._sums.get(reading.sensor, (reading, reading.pose))
        step, twist = Twist(*before.pose.between(reading.pose)), reading.twist
        if not self._over:
            step, twist = self.reported(step, twist, reading.tick - before.tick)
        pose = pose.compose(Pose2(*step))
        self._sums[reading.sensor] = reading, pose
        return replace(reading, pose=pose, twist=twist)

    def end(self) -> Disturbance | None:
        """The error stays."""
        self._over = True
        return self
