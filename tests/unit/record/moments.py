"""Synthetic run with all kinds of data that a log can contain."""

from collections.abc import Iterator

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, Path
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Reading, Scan
from simscen.core.records.case import Case
from simscen.core.records.events import Event
from simscen.core.records.trace import Decision, Moment, Truth
from simscen.record.log_header import LogHeader

CLOCK = Clock(240)
CASE = Case(
    start=Pose2(1 / 3, -2.0, 0.1),
    goals=(Goal("shelf", Pose2(4.0, 1.0, 1.5)), Goal("dock", Pose2(0.0, 0.1, -3.0), timeout=12.5)),
    shortest={"shelf": 4.123456789012345, "dock": float("inf")},
    regions={"aisle": ((0.0, 0.0), (1.0, 0.0), (1.0, 2.0))},
    footprint=((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)),
    inscribed_radius=0.2,
    time_limit=60.0,
)


def sample_header(seed: int = 7) -> LogHeader:
    cells = np.random.default_rng(seed).integers(-1, 101, size=(30, 40), dtype=np.int8)
    return LogHeader(
        name="navigation/goal",
        seed=seed,
        case=CASE,
        scenario="name: goal\n# ä comment\n",
        map=OccupancyGrid(cells, 0.05, Pose2(-1.0, -2.0, 0.3)),
        robot_description="<robot name='turtle'/>",
        mounts={"camera": Pose3(0.1, 0.0, 0.3)},
        files={"map.pgm": b"P5 1 1 255\n\0"},
        facts={"simscen": "0.1.0"},
    )


def moments(
    seconds: float = 2.0, seed: int = 0, particles: int = 500, beams: int = 360, extras: bool = True
) -> Iterator[Moment]:
    """Yield truth, odometry, and IMU at 40 Hz, commands at 20 Hz, scans and beliefs at 10 Hz, and some events."""
    rng = np.random.default_rng(seed)
    for tick in range(0, CLOCK.ticks(seconds) + 1, 6):
        x, y, yaw, z = rng.normal(size=4).tolist()
        vx, vy, wz = rng.normal(size=3).tolist()
        command = Twist(vx, 0.0, wz) if tick % 12 == 0 else Twist(0.0, 0.0, 0.25)
        readings: list[Reading] = [
            Odometry("wheels", tick, Pose2(x, y, 3 * yaw), Twist(vx, 0.0, wz)),
            Imu("imu", tick, (0.0, 0.0, wz), (vx, vy, 9.81)),
        ]
        belief, local_plan = None, None
        if tick % 24 == 0:
            ranges = np.round(rng.uniform(0.1, 12.0, size=beams), 3)
            ranges[:: max(1, beams // 7)] = np.inf
            readings.append(
                Scan("lidar", max(0, tick - 2), ranges, -np.pi, 2 * np.pi / beams, 0.1, 12.0, Pose2(0.1, 0.0))
            )
            square = rng.normal(size=(3, 3))
            cloud = rng.normal(size=(particles, 4))
            belief = Belief(Pose2(x, y, yaw), square @ square.T, Pose2(0.1, 0.2, 0.3), cloud, tick)
        if tick % 48 == 0:
            local_plan = Path(rng.normal(size=(30, 3)), tick)
        plan = Path(rng.normal(size=(100, 3)), max(0, tick - 1)) if tick % 240 == 0 else None
        if extras and tick % 120 == 0:
            readings.append(Odometry("visual", tick, Pose2(9.0, 9.0, 9.0), Twist()))
            readings.append(
                Scan("rear lidar", tick, np.array([1.0, np.nan]), 0.0, 0.1, 0.0, 9.0, Pose2(-0.2, 0.0, 3.0))
            )
            readings.append(Bump("bumper", tick, tick % 240 == 0))
            rgb = rng.integers(0, 256, size=(3, 4, 3), dtype=np.uint8)
            readings.append(Image("camera", tick, rgb, np.full((3, 4), np.inf, dtype=np.float32)))
        world_events = [Event(tick, "collision.started", "wall", {"x": x, "y": 1 / 3, "impulse": 1e-300})] * (
            tick == 240
        )
        stack_events = [Event(tick, "goal.accepted", "shelf", {"index": 0, "list": [1, 2.5, None, True]})] * (tick == 0)
        cart = Pose3(x, y, 0.1, 0.0, 0.0, np.sin(yaw), np.cos(yaw)) if tick > 120 else Pose3(1.0)
        truth = Truth(
            Pose3.from_rpy(x, y, z, 0.01, -0.02, yaw),
            Twist(vx, vy, wz),
            abs(y),
            {"cart": cart, "a box": Pose3(2.0, 3.0, 0.5)} if tick < 400 else {},
        )
        decision = Decision(command, belief, plan, local_plan, tuple(stack_events))
        yield Moment(
            tick, truth if tick % 12 == 0 or tick % 6 == 0 else None, tuple(readings), decision, tuple(world_events)
        )
