"""cmd_vel between stack and base, for runs in which commands come late or get lost."""

from simscen.core.geometry.kinematics import STOP, Twist


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
