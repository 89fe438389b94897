"""Pose and velocity of a robot, and samples of the true state whose clearances are computed later."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from simscen.core.geometry import Pose3, Vector
from simscen.core.geometry.kinematics import Twist
from simscen.core.records.trace import Truth

_new = tuple.__new__
"""Creates a named tuple without the call overhead of its class."""


class RobotState(NamedTuple):
    """Pose of the base frame in the world, and its linear (m/s) and angular (rad/s) velocity along the world axes."""

    pose: Pose3
    linear: Vector
    angular: Vector

    @property
    def twist(self) -> Twist:
        """The velocity in the base frame: forward (m/s), left (m/s), and turn rate (rad/s)."""
        # Both velocities are rotated by the inverse of the quaternion (x, y, z, w), written out for speed.
        (_, _, _, x, y, z, w), (a, b, c), (f, g, h) = self
        x, y, z = -x, -y, -z
        p, q, r = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        i, j, k = 2 * (y * h - z * g), 2 * (z * f - x * h), 2 * (x * g - y * f)
        return _new(Twist, (a + w * p + y * r - z * q, b + w * q + z * p - x * r, h + w * k + x * j - y * i))


class PendingTruth:
    """Sample of the true state at one tick whose clearance is computed later. Implements DeferredTruth."""

    __slots__ = ("compute", "objects", "result", "state")

    def __init__(self, compute: Callable[[], None], state: RobotState, objects: Mapping[str, Pose3]) -> None:
        """Take the function that sets `result` to the sample with its clearance."""
        self.compute, self.state, self.objects = compute, state, objects
        self.result: Truth | None = None

    def truth(self) -> Truth:
        """Return the sample with its clearance."""
        if self.result is None:
            self.compute()
        assert self.result is not None
        return self.result
