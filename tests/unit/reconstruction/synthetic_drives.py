"""Synthetic recorded drives of a robot with a lidar through a known room."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, Box, Cylinder, Solid
from simscen.reconstruction.compared_scans import ComparedScans, compare_scans
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, Scans, TimedValues
from simscen.reconstruction.static_world import StaticWorld

HEIGHT = 0.2
"""Height of the lidar in m."""
BEAMS = 360
ANGLES = -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS)
NOISE_M = 0.01
DURATION_S = 12.0
SPEED_M_S = 0.5


def wall(x: float, y: float, length: float, width: float, name: str = "wall") -> Solid:
    """Return a wall or pillar with the center (x, y)."""
    return Solid(Box((length, width, 1.0)), Pose3(x, y, 0.5, 0, 0, 0, 1), name)


ROOM = (
    wall(5, 0, 10, 0.1),
    wall(5, 6, 10, 0.1),
    wall(0, 3, 0.1, 6),
    wall(10, 3, 0.1, 6),
    wall(7, 1.2, 0.6, 0.6, "pillar"),
    wall(3.5, 5.2, 1.2, 0.4, "shelf"),
)


@lru_cache(maxsize=1)
def room() -> StaticWorld:
    """Return the room without objects."""
    return StaticWorld(World("room", ROOM), HEIGHT)


def poses(times: np.ndarray, curve: float = 0.3) -> np.ndarray:
    """Return the poses (n, 3) of a robot that drives from (1, 3) along the x axis.

    Its heading oscillates around 0 by `curve` rad.
    """
    yaw = curve * np.sin(times)
    fine_times = np.arange(0.0, DURATION_S + 0.01, 0.001)
    steps = (
        SPEED_M_S * 0.001 * np.column_stack((np.cos(curve * np.sin(fine_times)), np.sin(curve * np.sin(fine_times))))
    )
    path = np.array([1.0, 3.0]) + np.vstack((np.zeros(2), np.cumsum(steps, axis=0)))[:-1]
    return np.column_stack([*(np.interp(times, fine_times, path[:, axis]) for axis in (0, 1)), yaw])


def signal(times: np.ndarray, values: np.ndarray) -> TimedValues:
    """Return a signal without latency: it arrives when it is measured."""
    return TimedValues(times, np.asarray(values, dtype=np.float64).reshape(len(times), -1), times)


def body(x: float, y: float, yaw: float, size: tuple[float, ...]) -> Body:
    """Return a box if `size` is (length, width), or a cylinder if `size` is (radius,)."""
    shape = Cylinder(size[0], 1.0) if len(size) == 1 else Box((*size, 1.0))
    return Body("object", (Solid(shape, Pose3(0, 0, 0.5, 0, 0, 0, 1), "object"),), Pose3.planar(Pose2(x, y, yaw)))


def scans(objects: Any = None, offset: Pose2 = Pose2(0.0, 0.0), seed: int = 1) -> Scans:
    """Return scans at 10 Hz.

    `objects` returns the bodies at a time in s. `offset` is an error of the mount of the lidar.
    """
    times = np.arange(0.0, DURATION_S, 0.1)
    poses_at_times = poses(times)
    poses_at_times = np.array([Pose2(*pose).compose(offset) for pose in poses_at_times.tolist()])
    if objects is None:
        ranges = room().ranges_from(poses_at_times, ANGLES, 12.0)
    else:
        worlds = (StaticWorld(World("room", ROOM, tuple(objects(time))), HEIGHT) for time in times.tolist())
        ranges = np.vstack(
            [world.ranges_from(poses_at_times[k : k + 1], ANGLES, 12.0) for k, world in enumerate(worlds)]
        )
    ranges = np.round(ranges + np.random.default_rng(seed).normal(0.0, NOISE_M, ranges.shape), 3)
    return Scans(times, times, ranges, ANGLES, 0.12, 12.0, Pose2(0.0, 0.0), HEIGHT, np.zeros(len(times), dtype=bool))


def drive(measured: Scans | None = None, **changes: Any) -> RecordedDrive:
    """Return a drive without faults, in which `changes` replace fields."""
    times = np.arange(0.0, DURATION_S, 0.025)
    poses_at_times = poses(times)
    speed = np.column_stack(
        (np.full(len(times), SPEED_M_S), np.zeros(len(times)), np.gradient(poses_at_times[:, 2], times))
    )
    plain = RecordedDrive(
        "drive", DURATION_S, signal(times, poses_at_times), "ground truth", True,
        belief=signal(times[::4], np.column_stack((poses_at_times, np.full((len(times), 6), 0.01)))[::4]),
        odometry=signal(times, np.column_stack((poses_at_times, speed))),
        commands=signal(times, speed),
        turn_rates=signal(times, speed[:, 2]),
        scans=measured,
    )  # fmt: skip
    return replace(plain, **changes)


def compared_scans(measured: Scans) -> ComparedScans:
    """Return the comparison of the scans with the room."""
    return compare_scans(drive(measured), measured, room())


def with_ranges(measured: Scans, ranges: np.ndarray) -> Scans:
    """Return the scans with other ranges."""
    return replace(measured, ranges=ranges)
