"""What sensors say. A reading carries its sensor's instance name and the tick it was taken at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.kinematics import Twist

if TYPE_CHECKING:
    import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Scan:
    """A planar lidar scan.

    `ranges` (n,) in meters; inf where nothing was hit up to `range_max`, nan where the beam gave no answer. Beam k
    points at `angle_min + k * angle_increment` in the lidar's frame, which is at `mount` in the robot's base frame.
    """

    sensor: str
    tick: int
    ranges: Array
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    mount: Pose2 = Pose2(0.0, 0.0, 0.0)

    def angles(self) -> Array:
        """Beam directions (n,) in the lidar's frame, in radians."""
        return self.angle_min + self.angle_increment * np.arange(len(self.ranges), dtype=np.float64)

    def points(self) -> Array:
        """The hits (m, 2) in the robot's base frame; beams without a hit are left out."""
        hit = np.isfinite(self.ranges) & (self.ranges >= self.range_min) & (self.ranges <= self.range_max)
        angles, ranges = self.angles()[hit], self.ranges[hit]
        return self.mount.apply(np.column_stack((ranges * np.cos(angles), ranges * np.sin(angles))))


@fast_dataclass()
class Odometry:
    """Dead reckoning from the wheels: `pose` in the odom frame, `twist` in the base frame."""

    sensor: str
    tick: int
    pose: Pose2
    twist: Twist


@fast_dataclass()
class Imu:
    """Turn rate (rad/s, about x y z), specific force (m/s², with gravity) and heading (rad), in the base frame."""

    sensor: str
    tick: int
    angular_velocity: tuple[float, float, float]
    linear_acceleration: tuple[float, float, float]


@fast_dataclass()
class Bump:
    """A bumper: whether it is pressed."""

    sensor: str
    tick: int
    pressed: bool


@dataclass(frozen=True, eq=False)
class Image:
    """A camera frame: `rgb` (h, w, 3) uint8, `depth` (h, w) in meters along the optical axis, inf where nothing is.

    The camera sits at `mount` in the robot's base frame and looks along its x axis; `field_of_view` is horizontal, in
    rad, of square pixels. 0 where nobody has said how it sees.
    """

    sensor: str
    tick: int
    rgb: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    mount: Pose3 = Pose3()
    field_of_view: float = 0.0


Reading = Scan | Odometry | Imu | Bump | Image
Readings = tuple[Reading, ...]
