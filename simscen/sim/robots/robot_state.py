"""Where a robot is and how it moves: asked of the engine once for each tick, however many want to know."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from simscen.core.geometry import Pose3, Vector
from simscen.core.geometry.kinematics import Twist

_made = tuple.__new__  # a twist without the calls of its class


class RobotState(NamedTuple):
    """The base frame in the world, and the velocity of its origin (m/s, rad/s) along the world's axes."""

    pose: Pose3
    linear: Vector
    angular: Vector

    @property
    def twist(self) -> Twist:
        """The velocity in the base frame; as `geometry.rotated`, of which three components are needed, not six."""
        (_, _, _, x, y, z, w), (a, b, c), (f, g, h) = self
        x, y, z = -x, -y, -z
        p, q, r = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        i, j, k = 2 * (y * h - z * g), 2 * (z * f - x * h), 2 * (x * g - y * f)
        return _made(Twist, (a + w * p + y * r - z * q, b + w * q + z * p - x * r, h + w * k + x * j - y * i))


class TickClock(Protocol):
    """Something that says which tick it is."""

    @property
    def tick(self) -> int:
        """Ticks since the start."""
        ...


class CachedState:
    """Remembers the state of the tick that it was last asked for at; whoever sets a robot down has it forget that."""

    def __init__(self, ask: Callable[[], RobotState], now: TickClock) -> None:
        self._ask, self._now = ask, now
        self._tick, self._state = -1, RobotState(Pose3(), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def __call__(self) -> RobotState:
        """The state at this tick."""
        tick = self._now.tick
        if tick != self._tick:
            self._tick, self._state = tick, self._ask()
        return self._state

    def forget(self) -> None:
        """The robot is elsewhere all of a sudden."""
        self._tick = -1
