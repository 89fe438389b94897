"""Pose and velocity of a robot, queried from the engine at most once per tick."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from simscen.core.geometry import Pose3, Vector
from simscen.core.geometry.kinematics import Twist

_new = tuple.__new__  # creates a named tuple without the call overhead of its class


class RobotState(NamedTuple):
    """Pose of the base frame in the world, and velocity of its origin (m/s, rad/s) along the world axes."""

    pose: Pose3
    linear: Vector
    angular: Vector

    @property
    def twist(self) -> Twist:
        """The velocity in the base frame: forward, left, and turn rate.

        The values are those of `geometry.rotated`, without its other three components.
        """
        (_, _, _, x, y, z, w), (a, b, c), (f, g, h) = self
        x, y, z = -x, -y, -z
        p, q, r = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        i, j, k = 2 * (y * h - z * g), 2 * (z * f - x * h), 2 * (x * g - y * f)
        return _new(Twist, (a + w * p + y * r - z * q, b + w * q + z * p - x * r, h + w * k + x * j - y * i))


class TickClock(Protocol):
    """Provides the current tick."""

    @property
    def tick(self) -> int:
        """Ticks since the start."""
        ...


class CachedState:
    """State of a robot, cached for the current tick; must be invalidated when the robot is placed elsewhere."""

    def __init__(self, query: Callable[[], RobotState], clock: TickClock) -> None:
        self._query, self._clock = query, clock
        self._tick, self._state = -1, RobotState(Pose3(), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def __call__(self) -> RobotState:
        """Return the state at the current tick."""
        tick = self._clock.tick
        if tick != self._tick:
            self._tick, self._state = tick, self._query()
        return self._state

    def invalidate(self) -> None:
        """Discard the cached state."""
        self._tick = -1
