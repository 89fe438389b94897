"""Reads properties of a robot from a robot file, or writes a robot file from the log of a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from simscen.core.errors import SimscenError
from simscen.core.geometry import Array
from simscen.loading.files.discovery import default_root
from simscen.loading.files.single_files import load_robot_file
from simscen.loading.yaml.writing import CompactDumper, to_yaml
from simscen.reconstruction.drive.motion_steps import true_speeds
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, Scans, TimedValues, usual_period


@dataclass(frozen=True)
class RobotProperties:
    """Properties of a robot that the estimators need.

    Attributes:
        lidar_noise: Standard deviation of the lidar's ranges in m.
        radius: Radius in m of the circle around the footprint.
        wheel_separation: Distance in m between left and right wheels.
        skids: Whether the robot is a skid-steer robot, whose wheels skid sideways in turns.
        sensors: Names of the sensors in the robot file, by "lidar", "odom", and "imu"; empty without a robot file.
        is_known: Whether the properties are from the file of the recorded robot.
    """

    lidar_noise: float = 0.01
    radius: float = 0.25
    wheel_separation: float = 0.287
    skids: bool = False
    sensors: Mapping[str, str] = field(default_factory=dict)
    is_known: bool = False


TYPICAL_ROBOT = RobotProperties()
"""Properties that are assumed for a robot without a usable robot file."""


def robot_properties(robot: str, folder: Path, is_known: bool) -> RobotProperties:
    """Return the properties of a robot. Return TYPICAL_ROBOT if the robot file cannot be loaded.

    `robot` is the name of a shipped robot, or the path of a robot file relative to `folder`, the folder of the
    scenario. `is_known` states that the file describes the recorded robot.
    """
    file = folder / robot
    name = str(file) if file.is_file() else robot
    try:
        spec = load_robot_file(name, default_root([file if file.is_file() else folder / "x"])).robot.spec
    except SimscenError:
        return TYPICAL_ROBOT
    if spec is None:
        return TYPICAL_ROBOT
    lidars = [sensor.lidar for sensor in spec.sensors.values() if sensor.lidar]
    noise = lidars[0].noise if lidars else TYPICAL_ROBOT.lidar_noise
    wheel_separation = float(getattr(spec.drive, "wheel_separation", TYPICAL_ROBOT.wheel_separation))
    names: dict[str, str] = {}
    for name, sensor in spec.sensors.items():
        kinds = ("lidar", sensor.lidar), ("odom", sensor.odometry), ("imu", sensor.imu)
        names |= {kind: name for kind, setting in kinds if setting and kind not in names}
    corners = (math.hypot(x, y) for x, y in spec.footprint or ())
    radius = spec.radius or max(corners, default=TYPICAL_ROBOT.radius)
    return RobotProperties(noise, radius, wheel_separation, spec.drive.type == "skid_steer", names, is_known)


TICK_RATE_HZ = 240
"""Default tick rate of scenarios. It must be a multiple of the sensor rates."""
DEFAULT_RADIUS_M, MIN_RADIUS_M = 0.22, 0.1
"""Assumed radius of a robot with unknown footprint, and minimum radius of a robot that drove close to walls."""
DEFAULT_MASS_KG, DEFAULT_ACCELERATION_M_S2, DEFAULT_TURN_ACCELERATION_RAD_S2 = 5.0, 1.0, 3.2
"""Assumed mass and accelerations."""
DEFAULT_ODOMETRY_RATE_HZ, DEFAULT_IMU_RATE_HZ, DEFAULT_LIDAR_RATE_HZ = 40.0, 60.0, 10.0
"""Assumed rates of sensors with fewer than two messages."""
BODY_TOP_M, BODY_BOTTOM_M, MIN_LIDAR_HEIGHT_M = 0.12, 0.03, 0.15
"""Assumed heights of the top and bottom of the body, and minimum height of a lidar."""
WHEEL_RADIUS_M, SEPARATION_PER_HALF_WIDTH = 0.033, 1.3
"""Assumed radius of the wheels, and ratio of the wheel separation to half the width of the robot."""
VELOCITY_STEP_S = 0.25
"""Time over which velocities are averaged, if only poses are known."""
SPEED_PERCENTILE, SPEED_MARGIN = 99.0, 1.05
"""Percentile that is used as the maximum of the noisy speeds, and ratio of the speed limit to this maximum."""
MIN_SPEED_LIMIT_M_S, MIN_TURN_RATE_LIMIT_RAD_S = 0.1, 0.5
"""Minimum limits of speed and turn rate, for a robot that hardly moves."""
MAX_BEAMS, MAX_RANGE_M = 4096, 100.0
"""Maximum number of beams, and maximum range, of a lidar in a robot file."""


@dataclass(frozen=True)
class WrittenRobot:
    """Description of a written robot file.

    reason:    reason for its content
    unknowns:  phrases that complete the sentence "The log does not show …"
    """

    reason: str
    unknowns: list[str]


def write_robot_file(drive: RecordedDrive, file: Path, lidar_noise: float, clearance: float) -> WrittenRobot:
    """Write a robot file with the properties of the robot in a drive.

    `lidar_noise` is the standard deviation of the ranges in m. `clearance` is the smallest distance in m between the
    origin of the base and a wall, and limits the radius of the robot.
    """
    speed, turn_rate = observed_limits(drive)
    unknowns = ["mass, wheels, and accelerations of the robot; usual values are assumed"]
    assumed_radius = max(MIN_RADIUS_M, min(DEFAULT_RADIUS_M, math.floor(100 * clearance) / 100))
    radius = max((math.hypot(*corner) for corner in drive.footprint), default=assumed_radius)
    half_width = max((abs(y) for _, y in drive.footprint), default=radius)
    outline: dict[str, Any] = {"radius": radius}
    body: dict[str, Any] = {"cylinder": [round(radius, 3), round(BODY_TOP_M - BODY_BOTTOM_M, 3)], "z": BODY_BOTTOM_M}
    if drive.footprint:
        corners = [list(corner) for corner in drive.footprint]
        outline = {"footprint": corners}
        body = {"polygon": corners, "height": round(BODY_TOP_M - BODY_BOTTOM_M, 3), "z": BODY_BOTTOM_M}
    else:
        reason = " because it drove that close to walls" if radius < DEFAULT_RADIUS_M else ""
        unknowns.append(f"footprint of the robot; a radius of {radius} m is assumed{reason}")
    data = {
        "simscen": 1,
        "name": f"robot of {drive.name}",
        "mass": DEFAULT_MASS_KG,
        **outline,
        "body": [body],
        "drive": {
            "type": "differential",
            "wheel_radius": WHEEL_RADIUS_M,
            "wheel_separation": round(SEPARATION_PER_HALF_WIDTH * half_width, 3),
        },
        "limits": {
            "linear": speed,
            "angular": turn_rate,
            "linear_acceleration": DEFAULT_ACCELERATION_M_S2,
            "angular_acceleration": DEFAULT_TURN_ACCELERATION_RAD_S2,
        },
        "sensors": _sensors(drive, lidar_noise),
    }
    file.write_text(to_yaml(data, CompactDumper), encoding="utf-8")
    observed = ["speed limits", *(["footprint"] if drive.footprint else []), *(["lidar"] if drive.scans else [])]
    return WrittenRobot(f"{', '.join(observed)} as seen in the log", unknowns)


def observed_limits(drive: RecordedDrive) -> tuple[float, float]:
    """Return limits for the speed in m/s and the turn rate in rad/s: the maximum in the drive, with a margin.

    Speeds are from odometry and commands, or from the poses if the log has neither odometry nor commands. If the drive
    has true poses, the speeds of the odometry are replaced by true speeds.
    """
    true = true_speeds(drive) if drive.has_true_poses else np.empty(0)
    driven_speed = float(np.percentile(true, SPEED_PERCENTILE)) if len(true) else _max_value(drive.odometry, 3)
    speed = max(driven_speed, _max_value(drive.commands, 0))
    turn_rate = max(_max_value(drive.odometry, 5), _max_value(drive.commands, 2))
    if not len(drive.odometry) and not len(drive.commands):
        velocities = _velocities(drive.poses)
        speed, turn_rate = _max_value(velocities, 0), _max_value(velocities, 1)
    speed_limit = math.ceil(100 * SPEED_MARGIN * speed) / 100
    turn_rate_limit = math.ceil(100 * SPEED_MARGIN * turn_rate) / 100
    return max(speed_limit, MIN_SPEED_LIMIT_M_S), max(turn_rate_limit, MIN_TURN_RATE_LIMIT_RAD_S)


def _max_value(signal: TimedValues, column: int) -> float:
    """Return the SPEED_PERCENTILE of the absolute values in a column; 0 without values."""
    return float(np.percentile(np.abs(signal.values[:, column]), SPEED_PERCENTILE)) if len(signal) else 0.0


def _velocities(poses: TimedValues) -> TimedValues:
    """Return the speed and the turn rate (n, 2) between poses, averaged over VELOCITY_STEP_S."""
    times = np.arange(poses.times[0], poses.times[-1], VELOCITY_STEP_S)
    steps = np.diff(poses.poses_at(times), axis=0) / VELOCITY_STEP_S
    turn_rates = np.diff(np.unwrap(poses.poses_at(times)[:, 2])) / VELOCITY_STEP_S
    return TimedValues(times[1:], np.column_stack((np.hypot(steps[:, 0], steps[:, 1]), turn_rates)), times[1:])


def _sensors(drive: RecordedDrive, lidar_noise: float) -> dict[str, Any]:
    """Return the value of the key `sensors`."""
    sensors: dict[str, Any] = {}
    if drive.scans is not None:
        sensors["lidar"] = {"lidar": _lidar(drive.scans, lidar_noise)}
    sensors["odom"] = {"odometry": {"rate": _rate(drive.odometry.times, DEFAULT_ODOMETRY_RATE_HZ)}}
    if len(drive.turn_rates) > 1:
        sensors["imu"] = {"imu": {"rate": _rate(drive.turn_rates.times, DEFAULT_IMU_RATE_HZ)}}
    return sensors


def _lidar(scans: Scans, noise: float) -> dict[str, Any]:
    """Return the value of the key `lidar`. `noise` is the standard deviation of the ranges in m."""
    step = abs(float(scans.angles[1] - scans.angles[0]))
    is_full_circle = len(scans.angles) * step > 2 * math.pi - 1.5 * step
    field_of_view = 2 * math.pi if is_full_circle else float(np.ptp(scans.angles))
    center = 0.0 if is_full_circle else float(scans.angles.mean())
    x, y, yaw = scans.mount
    mount = {"x": round(x, 3), "y": round(y, 3), "z": round(max(scans.height, MIN_LIDAR_HEIGHT_M), 3)}
    mount["yaw"] = round(yaw + center, 4)
    return {
        "rate": _rate(scans.times, DEFAULT_LIDAR_RATE_HZ),
        "beams": min(len(scans.angles), MAX_BEAMS),
        "field_of_view": round(field_of_view, 5),
        "min_range": round(float(scans.range_min), 3),
        "max_range": round(float(min(scans.range_max, MAX_RANGE_M)), 2),
        "noise": round(noise, 4),
        "mount": mount,
    }


def _rate(times: Array, default: float) -> float:
    """Return the rate in Hz of messages at `times` (n,), rounded to a divisor of the tick rate.

    `default` is the rate in Hz for fewer than two messages.
    """
    measured = 1.0 / max(usual_period(times), 1e-3) if len(times) > 1 else default
    divisors = [rate for rate in range(1, TICK_RATE_HZ + 1) if TICK_RATE_HZ % rate == 0]
    return float(min(divisors, key=lambda rate: abs(math.log(rate / measured))))
