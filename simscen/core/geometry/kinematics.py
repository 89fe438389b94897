"""Planar velocities and the kinematics of four mecanum wheels."""

from dataclasses import dataclass
from typing import NamedTuple


class Twist(NamedTuple):
    """A velocity of the robot's base in its own frame: m/s forward, m/s to the left, rad/s anticlockwise."""

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0


STOP = Twist()


WheelValues = tuple[float, float, float, float]
"""Of the wheels front left, front right, rear left, rear right."""


@dataclass(frozen=True)
class MecanumWheels:
    """Wheels of `radius`, `half_base` before and behind and `half_track` beside the middle, all in meters.

    `slant` is the cotangent of the angle between a roller and its wheel's axle: 1 for 45 degrees. Seen from above the
    rollers on top point to the middle (those on the ground make an O). Taheri, Qiao and Ghaeminezhad, Kinematic Model
    of a Four Mecanum Wheeled Mobile Robot, IJCA 113(3), 2015; here for any slant: a roller hands over only motion along
    its own axis.
    """

    radius: float
    half_track: float
    half_base: float
    slant: float = 1.0

    @property
    def lever(self) -> float:
        """Meters that a wheel rolls for each radian that the base turns."""
        return self.half_track + self.slant * self.half_base

    def speeds(self, motion: Twist) -> WheelValues:
        """Angles in rad (or rad/s) that the wheels roll for a motion of the base (m, m, rad, or each a second)."""
        ahead, left, turn = motion.vx, self.slant * motion.vy, self.lever * motion.wz
        return (
            (ahead - left - turn) / self.radius,
            (ahead + left + turn) / self.radius,
            (ahead + left - turn) / self.radius,
            (ahead - left + turn) / self.radius,
        )

    def motion(self, speeds: WheelValues) -> Twist:
        """The motion of the base that agrees best with what the wheels rolled: the pseudo-inverse of `speeds`."""
        front_left, front_right, rear_left, rear_right = (self.radius * speed / 4 for speed in speeds)
        return Twist(
            front_left + front_right + rear_left + rear_right,
            (-front_left + front_right + rear_left - rear_right) / self.slant,
            (-front_left + front_right - rear_left + rear_right) / self.lever,
        )
