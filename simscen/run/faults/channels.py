"""cmd_vel between stack and base, for runs in which commands come late or get lost."""

from collections.abc import Callable

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.localization import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.stack.protocols import Localizer


class CommandLink:
    """The last command that the base has heard of.

    The stack sends one message each `period` ticks, and one at once when it wants something else in between. A base
    that hears nothing for `timeout` ticks stops, as ros2_control's drives do (`cmd_vel_timeout`); a timeout shorter
    than the time between two messages would never let it drive.
    """

    def __init__(self, period: int, timeout: int) -> None:
        self._period, self._timeout = period, max(period, timeout)
        self._sent: Twist | None = None
        self._heard, self._since = STOP, 0

    def sends(self, tick: int, command: Twist) -> bool:
        """Whether the stack sends a message at this beat."""
        sends = tick % self._period == 0 or command != self._sent
        self._sent = command
        return sends

    def hear(self, tick: int, command: Twist) -> None:
        """A message has arrived."""
        self._heard, self._since = command, tick

    def driven(self, tick: int) -> Twist:
        """What the base drives by what it has heard."""
        return self._heard if tick - self._since <= self._timeout else STOP


# MERGED: What stands between the localizer and the navigator, so that a fault can tell the navigator something else.
class LocalizerWithFaults:
    """A localizer whose belief reaches the others as `told` makes it; it goes on believing what it believes."""

    def __init__(self, inner: Localizer, told: Callable[[Belief], Belief]) -> None:
        self._inner, self._told = inner, told

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate."""
        self._inner.reset(estimate)

    def on_odometry(self, odometry: Odometry) -> None:
        """Take a step of dead reckoning."""
        self._inner.on_odometry(odometry)

    def on_scan(self, scan: Scan) -> None:
        """Correct with a lidar scan."""
        self._inner.on_scan(scan)

    def on_imu(self, imu: Imu) -> None:
        """Take a turn rate."""
        self._inner.on_imu(imu)

    @property
    def belief(self) -> Belief:
        """What the navigator hears."""
        return self._told(self._inner.belief)
