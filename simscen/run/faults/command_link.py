"""Model of the cmd_vel connection, over which faults can delay or drop commands."""

from simscen.core.geometry.kinematics import STOP, Twist


class CommandLink:
    """The cmd_vel connection between stack and base.

    The stack sends a message every `period` ticks, and whenever the command changes. The base stops if no message
    arrives for `timeout` ticks, as in ros2_control (`cmd_vel_timeout`). The timeout is at least one period.
    """

    def __init__(self, period: int, timeout: int) -> None:
        """`period` and `timeout` are in ticks."""
        self._period, self._timeout = period, max(period, timeout)
        self._last_command: Twist | None = None
        self._received_command, self._received_tick = STOP, 0

    def send(self, tick: int, command: Twist) -> bool:
        """Return whether the stack sends a message with `command` at `tick`. Call this once for each command."""
        is_sent = tick % self._period == 0 or command != self._last_command
        self._last_command = command
        return is_sent

    def receive(self, tick: int, command: Twist) -> None:
        """Let the base receive a message at `tick`."""
        self._received_command, self._received_tick = command, tick

    def active_command(self, tick: int) -> Twist:
        """Return the command that the base executes: the last received command, or STOP after the timeout."""
        return self._received_command if tick - self._received_tick <= self._timeout else STOP
