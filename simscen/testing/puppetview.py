"""A robot that drives a circle in an empty square room, as sensors see it: closed forms, no physics."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.ray_fans import RayCaster
from simscen.model.robot import Differential

SPEED, TURN = 0.3, 0.2
"""m/s and rad/s."""
HALF = 4.0
"""Meters from the middle of the room to its walls."""
DRIVE = Differential(type="differential", wheel_separation=0.3, wheel_radius=0.05)


class PuppetView:
    """A sensors.sensor.SensorView: where the robot is `seconds` after its start; that is set by hand."""

    seconds = 0.0

    def base_pose(self) -> Pose3:
        """On a circle around (0, 1.5)."""
        yaw, radius = TURN * self.seconds, SPEED / TURN
        return Pose3.planar(Pose2(radius * math.sin(yaw), radius * (1 - math.cos(yaw)), yaw))

    def base_velocity(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Along the world's axes."""
        yaw = TURN * self.seconds
        return (SPEED * math.cos(yaw), SPEED * math.sin(yaw), 0.0), (0.0, 0.0, TURN)

    def encoders(self) -> tuple[float, ...]:
        """Radians of the left and the right wheel."""
        half = DRIVE.wheel_separation / 2
        left, right = (SPEED - TURN * half), (SPEED + TURN * half)
        return tuple(speed * self.seconds / DRIVE.wheel_radius for speed in (left, right))

    def touching(self) -> bool:
        """Every other second."""
        return int(self.seconds) % 2 == 1

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """Gray, two meters away."""
        return np.full((height, width, 3), 128, np.uint8), np.full((height, width), min(2.0, far), np.float32)


class SquareRoom(RayCaster):
    """Rays to the four walls."""

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """See core.geometry.ray_fans.RayCaster."""
        with np.errstate(divide="ignore", invalid="ignore"):
            walls = (np.sign(directions[:, :2]) * HALF - origins[:, :2]) / directions[:, :2]
        far: Array = np.nanmin(np.where(walls > 0, walls, np.inf), axis=1)
        return np.where(far <= reach, far, np.inf)
