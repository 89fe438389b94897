"""What the robot file says about the robot of a drive: properties that are no faults."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import SimscenError
from simscen.loading.files.discovery import default_root
from simscen.loading.files.single_files import load_robot_file


@dataclass(frozen=True)
class KnownRobot:
    """Properties of a robot.

    Attributes:
        lidar_noise: Standard deviation of the ranges of the lidar in m.
        radius: Radius of the circle around its footprint in m.
        separation: Distance of the left and right wheels in m.
        skids: Whether the wheels skid in turns.
        sensors: Names of its sensors by the usual name: "lidar", "odom", "imu". Empty if they are unknown.
        is_known: Whether the properties are those of the robot; otherwise they are those of a usual one.
    """

    lidar_noise: float = 0.01
    radius: float = 0.25
    separation: float = 0.287
    skids: bool = False
    sensors: Mapping[str, str] = field(default_factory=dict)
    is_known: bool = False


UNKNOWN_ROBOT = KnownRobot()


def known_robot(written: str, folder: Path, is_known: bool) -> KnownRobot:
    """Return the properties of a robot that a scenario in a folder names. `is_known` if it is the robot of the log."""
    file = folder / written
    name = str(file) if file.is_file() else written
    try:
        spec = load_robot_file(name, default_root([file if file.is_file() else folder / "x"])).robot.spec
    except SimscenError:
        return UNKNOWN_ROBOT
    if spec is None:
        return UNKNOWN_ROBOT
    lidars = [sensor.lidar for sensor in spec.sensors.values() if sensor.lidar]
    noise = lidars[0].noise if lidars else UNKNOWN_ROBOT.lidar_noise
    separation = float(getattr(spec.drive, "wheel_separation", UNKNOWN_ROBOT.separation))
    names: dict[str, str] = {}
    for name, sensor in spec.sensors.items():
        kinds = ("lidar", sensor.lidar), ("odom", sensor.odometry), ("imu", sensor.imu)
        names |= {usual: name for usual, given in kinds if given and usual not in names}
    corners = (math.hypot(x, y) for x, y in spec.footprint or ())
    radius = spec.radius or max(corners, default=UNKNOWN_ROBOT.radius)
    return KnownRobot(noise, radius, separation, spec.drive.type == "skid_steer", names, is_known)
