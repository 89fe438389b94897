"""Where a robot is and how it moves: asked of the engine once for each tick, however many want to know."""

from collections.abc import Callable
from typing import NamedTuple

from simscen.core.geometry import Pose3, Vector, rotated
from simscen.core.motion import Twist


class State(NamedTuple):
    """The base frame in the world, and the velocity of its origin (m/s, rad/s) along the world's axes."""

    pose: Pose3
    linear: Vector
    angular: Vector

    @property
    def twist(self) -> Twist:
        """The velocity in the base frame."""
        pose = self.pose
        back = (-pose.qx, -pose.qy, -pose.qz, pose.qw)
        vx, vy, _ = rotated(back, self.linear)
        return Twist(vx, vy, rotated(back, self.angular)[2])


class Seen:
    """Remembers the state of the tick that it was last asked for at; whoever sets a robot down has it forget that."""

    def __init__(self, ask: Callable[[], State], now: Callable[[], int]) -> None:
        self._ask, self._now = ask, now
        self._tick, self._state = -1, State(Pose3(), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def __call__(self) -> State:
        """The state at this tick."""
        tick = self._now()
        if tick != self._tick:
            self._tick, self._state = tick, self._ask()
        return self._state

    def forget(self) -> None:
        """The robot is elsewhere all of a sudden."""
        self._tick = -1
