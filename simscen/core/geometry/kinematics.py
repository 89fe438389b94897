"""Planar velocities and the kinematics of four mecanum wheels."""

from dataclasses import dataclass
from typing import NamedTuple


class Twist(NamedTuple):
    """Velocity in the base frame: m/s forward, m/s to the left, rad/s counterclockwise."""

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0


STOP = Twist()
"""Velocity of a robot at rest."""


WheelValues = tuple[float, float, float, float]
"""Values of the front left, front right, rear left and rear right wheel."""


@dataclass(frozen=True)
class MecanumWheels:
    """Kinematics of a base with four mecanum wheels.

    The wheels have the radius `radius` m, and are `half_base` m (along x) and `half_track` m (along y) from the center.
    `slant` is the cotangent of the angle between roller and wheel axle: 1 for 45 degrees. Seen from above, the rollers
    form an X.
    Source: Taheri, Qiao and Ghaeminezhad, "Kinematic Model of a Four Mecanum Wheeled Mobile Robot", IJCA 113(3), 2015.
    """

    radius: float
    half_track: float
    half_base: float
    slant: float = 1.0

    @property
    def lever(self) -> float:
        """Distance in m that each wheel rolls when the base rotates by one radian."""
        return self.half_track + self.slant * self.half_base

    def speeds(self, motion: Twist) -> WheelValues:
        """Return the wheel speeds in rad/s for a velocity of the base."""
        forward, left, turn = motion.vx, self.slant * motion.vy, self.lever * motion.wz
        return (
            (forward - left - turn) / self.radius,
            (forward + left + turn) / self.radius,
            (forward + left - turn) / self.radius,
            (forward - left + turn) / self.radius,
        )

    def motion(self, speeds: WheelValues) -> Twist:
        """Return the velocity of the base that fits wheel speeds in rad/s best (least squares)."""
        front_left, front_right, rear_left, rear_right = (self.radius * speed / 4 for speed in speeds)
        return Twist(
            front_left + front_right + rear_left + rear_right,
            (-front_left + front_right + rear_left - rear_right) / self.slant,
            (-front_left + front_right - rear_left + rear_right) / self.lever,
        )
