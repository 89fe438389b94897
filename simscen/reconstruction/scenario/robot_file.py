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
        sensors: Names in the robot file of the sensors "lidar", "odom", and "imu"; empty if the file is unknown.
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
    """Return the properties of a robot file or shipped robot; TYPICAL_ROBOT if it cannot be loaded.

    `folder` is the folder of the scenario. `is_known` states that the file describes the recorded robot.
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
        names |= {usual: name for usual, given in kinds if given and usual not in names}
    corners = (math.hypot(x, y) for x, y in spec.footprint or ())
    radius = spec.radius or max(corners, default=TYPICAL_ROBOT.radius)
    return RobotProperties(noise, radius, wheel_separation, spec.drive.type == "skid_steer", names, is_known)


TICK_RATE_HZ = 240
"""Default tick rate of scenarios, which must be a multiple of the sensor rates."""
DEFAULT_RADIUS_M, MIN_RADIUS_M = 0.22, 0.1
"""Assumed radius of a robot with unknown footprint, and minimum radius of a robot that drove close to walls."""
DEFAULT_MASS_KG, DEFAULT_ACCELERATION_M_S2, DEFAULT_TURN_ACCELERATION_RAD_S2 = 5.0, 1.0, 3.2
"""Assumed mass and accelerations."""
BODY_TOP_M, BODY_BOTTOM_M, MIN_LIDAR_HEIGHT_M = 0.12, 0.03, 0.15
"""Assumed heights of the top and bottom of the body, and minimum height of a lidar."""
WHEEL_RADIUS_M, SEPARATION_PER_HALF_WIDTH = 0.033, 1.3
"""Assumed radius of the wheels, and ratio of the wheel separation to half the width of the robot."""
VELOCITY_STEP_S = 0.25
"""Time over which velocities are averaged, if only poses are known."""
SPEED_PERCENTILE, SPEED_MARGIN = 99.0, 1.05
"""Percentile that is used as the maximum of the noisy speeds, and ratio of the speed limit to this maximum."""
MIN_SPEED_M_S, MIN_TURN_RATE_RAD_S = 0.1, 0.5
"""Minimum of the speed limits, for a robot that hardly moves."""
MAX_BEAMS = 4096
"""Maximum number of beams of a lidar in a robot file."""


@dataclass(frozen=True)
class WrittenRobot:
    """Written robot file, reason for its content, and phrases about properties of the robot that the log lacks."""

    file: Path
    reason: str
    unknowns: list[str]


def write_robot_file(drive: RecordedDrive, file: Path, lidar_noise: float, clearance: float) -> WrittenRobot:
    """Write a robot file with the properties of the robot in a drive.

    `lidar_noise` is the standard deviation of the ranges in m. `clearance` is the smallest distance in m between the
    origin of the base and a wall, and limits the radius of the robot.
    """
    speed, turn_rate = observed_limits(drive)
    unknowns = ["mass, wheels, and accelerations of the robot; usual values are assumed"]
    assumed = max(MIN_RADIUS_M, min(DEFAULT_RADIUS_M, math.floor(100 * clearance) / 100))
    radius = max((math.hypot(*corner) for corner in drive.footprint), default=assumed)
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
    known = ["speed limits", *(["footprint"] if drive.footprint else []), *(["lidar"] if drive.scans else [])]
    return WrittenRobot(file, f"{', '.join(known)} as seen in the log", unknowns)


def observed_limits(drive: RecordedDrive) -> tuple[float, float]:
    """Return limits for the speed in m/s and the turn rate in rad/s: the maximum in the drive, with a margin.

    Speeds are from odometry and commands, or from the poses if the log has neither. A ground truth replaces the speeds
    of the odometry.
    """
    of_truth = true_speeds(drive) if drive.has_true_poses else np.empty(0)
    driven = float(np.percentile(of_truth, SPEED_PERCENTILE)) if len(of_truth) else _largest(drive.odometry, 3)
    speeds = driven, _largest(drive.commands, 0)
    turns = _largest(drive.odometry, 5), _largest(drive.commands, 2)
    if not len(drive.odometry) and not len(drive.commands):
        of_poses = _velocities(drive.poses)
        speeds, turns = (_largest(of_poses, 0), 0.0), (_largest(of_poses, 1), 0.0)
    speed = math.ceil(100 * SPEED_MARGIN * max(speeds)) / 100
    turn_rate = math.ceil(100 * SPEED_MARGIN * max(turns)) / 100
    return max(speed, MIN_SPEED_M_S), max(turn_rate, MIN_TURN_RATE_RAD_S)


def _largest(signal: TimedValues, column: int) -> float:
    """Return the SPEED_PERCENTILE of the absolute values in a column; 0 without values."""
    return float(np.percentile(np.abs(signal.values[:, column]), SPEED_PERCENTILE)) if len(signal) else 0.0


def _velocities(poses: TimedValues) -> TimedValues:
    """Return the speed and the turn rate (n, 2) between poses, averaged over VELOCITY_STEP_S."""
    times = np.arange(poses.times[0], poses.times[-1], VELOCITY_STEP_S)
    steps = np.diff(poses.poses_at(times), axis=0) / VELOCITY_STEP_S
    turns = np.diff(np.unwrap(poses.poses_at(times)[:, 2])) / VELOCITY_STEP_S
    return TimedValues(times[1:], np.column_stack((np.hypot(steps[:, 0], steps[:, 1]), turns)), times[1:])


def _sensors(drive: RecordedDrive, lidar_noise: float) -> dict[str, Any]:
    sensors: dict[str, Any] = {}
    if drive.scans is not None:
        sensors["lidar"] = {"lidar": _lidar(drive.scans, lidar_noise)}
    sensors["odom"] = {"odometry": {"rate": _rate(drive.odometry.times, 40.0)}}
    if len(drive.turn_rates) > 1:
        sensors["imu"] = {"imu": {"rate": _rate(drive.turn_rates.times, 60.0)}}
    return sensors


def _lidar(scans: Scans, noise: float) -> dict[str, Any]:
    """Return the value of the key `lidar`. `noise` is the standard deviation of the ranges in m."""
    step = abs(float(scans.angles[1] - scans.angles[0]))
    full = len(scans.angles) * step > 2 * math.pi - 1.5 * step
    view = 2 * math.pi if full else float(np.ptp(scans.angles))
    center = 0.0 if full else float(scans.angles.mean())
    x, y, yaw = scans.mount
    mount = {"x": round(x, 3), "y": round(y, 3), "z": round(max(scans.height, MIN_LIDAR_HEIGHT_M), 3)}
    mount["yaw"] = round(yaw + center, 4)
    return {
        "rate": _rate(scans.times, 10.0),
        "beams": min(len(scans.angles), MAX_BEAMS),
        "field_of_view": round(view, 5),
        "min_range": round(float(scans.range_min), 3),
        "max_range": round(float(min(scans.range_max, 100.0)), 2),
        "noise": round(noise, 4),
        "mount": mount,
    }


def _rate(times: Array, usual: float) -> float:
    """Return the divisor of the tick rate, in Hz, nearest to the rate of a signal (`usual` if unknown)."""
    measured = 1.0 / max(usual_period(times), 1e-3) if len(times) > 1 else usual
    divisors = [rate for rate in range(1, TICK_RATE_HZ + 1) if TICK_RATE_HZ % rate == 0]
    return float(min(divisors, key=lambda rate: abs(math.log(rate / measured))))
