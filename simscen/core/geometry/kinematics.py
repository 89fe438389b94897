"""Planar velocities and the kinematics of four mecanum wheels."""

from dataclasses import dataclass
from typing import NamedTuple


class Twist(NamedTuple):
    """Velocity of the base in its own frame: m/s forward, m/s to the left, rad/s counterclockwise."""

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0


STOP = Twist()


WheelValues = tuple[float, float, float, float]
"""Values of the front left, front right, rear left and rear right wheel."""


@dataclass(frozen=True)
class MecanumWheels:
    """Four mecanum wheels of `radius`, at distances `half_base` (x) and `half_track` (y) from the center, in m.

    `slant` is the cotangent of the angle between roller and wheel axle: 1 for 45 degrees. Seen from above, the upper
    rollers point to the center, and the lower ones form an O. Kinematics of Taheri, Qiao and Ghaeminezhad, "Kinematic
    Model of a Four Mecanum Wheeled Mobile Robot", IJCA 113(3), 2015, for any slant.
    """

    radius: float
    half_track: float
    half_base: float
    slant: float = 1.0

    @property
    def lever(self) -> float:
        """Distance in m that a wheel rolls per radian of rotation of the base."""
        return self.half_track + self.slant * self.half_base

    def speeds(self, motion: Twist) -> WheelValues:
        """Return the wheel rotations in rad (or rad/s) for a motion of the base in m and rad (or per second)."""
        forward, left, turn = motion.vx, self.slant * motion.vy, self.lever * motion.wz
        return (
            (forward - left - turn) / self.radius,
            (forward + left + turn) / self.radius,
            (forward + left - turn) / self.radius,
            (forward - left + turn) / self.radius,
        )

    def motion(self, speeds: WheelValues) -> Twist:
        """Return the least-squares motion of the base for wheel rotations: the pseudo-inverse of `speeds`."""
        front_left, front_right, rear_left, rear_right = (self.radius * speed / 4 for speed in speeds)
        return Twist(
            front_left + front_right + rear_left + rear_right,
            (-front_left + front_right + rear_left - rear_right) / self.slant,
            (-front_left + front_right - rear_left + rear_right) / self.lever,
        )
