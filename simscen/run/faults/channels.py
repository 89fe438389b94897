"""Channels that faults can disturb: the velocity commands to the base and the beliefs of the localizer."""

from collections.abc import Callable

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.localization import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.stack.protocols import Localizer


class CommandLink:
    """The cmd_vel connection between stack and base, in which commands can be late or lost.

    The stack sends one message each `period` ticks, and another one whenever the command changes. The base stops if no
    message arrives for `timeout` ticks, like the drives of ros2_control (`cmd_vel_timeout`). The timeout is at least
    one period, because the base could never drive otherwise.
    """

    def __init__(self, period: int, timeout: int) -> None:
        self._period, self._timeout = period, max(period, timeout)
        self._sent: Twist | None = None
        self._heard, self._since = STOP, 0

    def sends(self, tick: int, command: Twist) -> bool:
        """Return whether the stack sends a message at this beat."""
        sends = tick % self._period == 0 or command != self._sent
        self._sent = command
        return sends

    def hear(self, tick: int, command: Twist) -> None:
        """Receive a message."""
        self._heard, self._since = command, tick

    def driven(self, tick: int) -> Twist:
        """Return the command that the base executes."""
        return self._heard if tick - self._since <= self._timeout else STOP


class LocalizerWithFaults:
    """A localizer whose published belief is changed by faults; its internal state is not affected."""

    def __init__(self, inner: Localizer, told: Callable[[Belief], Belief]) -> None:
        self._inner, self._told = inner, told

    def reset(self, estimate: Estimate) -> None:
        """Reset to an initial estimate."""
        self._inner.reset(estimate)

    def on_odometry(self, odometry: Odometry) -> None:
        """Update with odometry."""
        self._inner.on_odometry(odometry)

    def on_scan(self, scan: Scan) -> None:
        """Update with a lidar scan."""
        self._inner.on_scan(scan)

    def on_imu(self, imu: Imu) -> None:
        """Update with an IMU reading."""
        self._inner.on_imu(imu)

    @property
    def belief(self) -> Belief:
        """The belief after the faults."""
        return self._told(self._inner.belief)
