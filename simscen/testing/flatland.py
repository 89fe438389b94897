"""Planar world of boxes and discs, and drives through this world without a physics engine, for tests of stacks.

Distances and ranges are computed with closed formulas, which are independent of the tested code.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Estimate, Path
from simscen.core.messages.sensor_data import Odometry, Reading, Scan
from simscen.core.random_streams import Streams
from simscen.core.records.events import Event
from simscen.model.localizers import GroundTruth
from simscen.model.stack import StackSpec
from simscen.stack.protocols import RobotModel, Stack, Surroundings
from simscen.stack.setting import Setting

TICK_RATE_HZ = 240
CONTROL_PERIOD_TICKS, SCAN_PERIOD_TICKS, ODOMETRY_PERIOD_TICKS = 12, 24, 6


def round_robot(radius: float = 0.22, speed: float = 0.5, **limits: float) -> RobotModel:
    """Return a round robot like a TurtleBot. `radius` is in m, `speed` in m/s; `limits` are fields of RobotModel."""
    angles = np.linspace(0, 2 * math.pi, 16, endpoint=False)
    corners = tuple((radius * math.cos(a), radius * math.sin(a)) for a in angles)
    data: dict[str, Any] = {
        "max_reverse": speed,
        "max_lateral": 0.0,
        "max_angular": 1.9,
        "linear_acceleration": 2.5,
        "linear_deceleration": 2.5,
    }
    return RobotModel(corners, radius, max_linear=speed, angular_acceleration=3.2, **{**data, **limits})


def box_robot(length: float = 0.42, width: float = 0.31, speed: float = 2.0) -> RobotModel:
    """Return a rectangular robot like a Jackal. `length` and `width` are in m, `speed` in m/s."""
    a, b = length / 2, width / 2
    return RobotModel(
        footprint=((a, b), (-a, b), (-a, -b), (a, -b)),
        radius=None,
        max_linear=speed,
        max_reverse=speed,
        max_lateral=0.0,
        max_angular=2.0,
        linear_acceleration=5.0,
        linear_deceleration=5.0,
        angular_acceleration=10.0,
    )


def setting(robot: RobotModel, *, name: str = "test") -> Setting:
    """Return the Setting for a component called `name`: no map, control at 20 Hz, costmap cells of 5 cm."""
    surroundings = Surroundings(robot, None, TICK_RATE_HZ, lidars=("lidar",))
    return Setting(surroundings, name, Streams(1), CONTROL_PERIOD_TICKS / TICK_RATE_HZ, 0.05)


@dataclass
class Flatland:
    """World of boxes (min x, min y, max x, max y) and discs (x, y, radius) in m."""

    boxes: list[tuple[float, float, float, float]] = field(default_factory=list)
    discs: list[tuple[float, float, float]] = field(default_factory=list)

    def room(self, width: float, height: float, wall: float = 0.1) -> "Flatland":
        """Add walls around the rectangle from (0, 0) to (width, height), and return the world."""
        self.boxes += [
            (-wall, -wall, width + wall, 0.0),
            (-wall, height, width + wall, height + wall),
            (-wall, 0.0, 0.0, height),
            (width, 0.0, width + wall, height),
        ]
        return self

    def grid(self, bounds: tuple[float, float, float, float], resolution: float = 0.05) -> OccupancyGrid:
        """Return the map of the area `bounds` (min x, min y, max x, max y) in m, with cells of `resolution` m.

        A cell is occupied if its center is in an obstacle.
        """
        columns, rows = (round((bounds[i + 2] - bounds[i]) / resolution) for i in (0, 1))
        y, x = (np.indices((rows, columns)) + 0.5) * resolution
        distance = self.distance(np.column_stack(((x + bounds[0]).ravel(), (y + bounds[1]).ravel())))
        cells = np.where(distance.reshape(rows, columns) <= 0, 100, 0).astype(np.int8)
        return OccupancyGrid(cells, resolution, Pose2(bounds[0], bounds[1]))

    def distance(self, points: Array) -> Array:
        """Return signed distances (n,) in m from points (n, 2) to the nearest surface; negative inside obstacles."""
        result = np.full(len(points), np.inf)
        for ax, ay, bx, by in self.boxes:
            dx = np.maximum(ax - points[:, 0], points[:, 0] - bx)
            dy = np.maximum(ay - points[:, 1], points[:, 1] - by)
            outside = np.hypot(np.maximum(dx, 0), np.maximum(dy, 0))
            result = np.minimum(result, outside + np.minimum(np.maximum(dx, dy), 0))
        if self.discs:
            discs = np.array(self.discs)
            gaps = np.hypot(points[:, None, 0] - discs[:, 0], points[:, None, 1] - discs[:, 1]) - discs[:, 2]
            result = np.minimum(result, gaps.min(axis=1))
        return result

    def cast(self, origin: tuple[float, float], angles: Array) -> Array:
        """Return ranges (n,) in m of rays from `origin` (x, y) at world `angles` (n,) in rad; inf without a hit."""
        c, s = np.cos(angles), np.sin(angles)
        nearest = np.full(len(angles), np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            for ax, ay, bx, by in self.boxes:
                tx = np.sort(np.stack(((ax - origin[0]) / c, (bx - origin[0]) / c)), axis=0)
                ty = np.sort(np.stack(((ay - origin[1]) / s, (by - origin[1]) / s)), axis=0)
                near, far = np.maximum(tx[0], ty[0]), np.minimum(tx[1], ty[1])
                nearest = np.where((near <= far) & (far > 0), np.minimum(nearest, np.maximum(near, 0)), nearest)
            for x, y, radius in self.discs:
                dx, dy = x - origin[0], y - origin[1]
                along, across = dx * c + dy * s, dx * s - dy * c
                half_chord = np.sqrt(radius**2 - across**2)
                is_hit = (half_chord >= 0) & (along > 0)
                nearest = np.where(is_hit, np.minimum(nearest, along - half_chord), nearest)
        return nearest

    def clearance(self, robot: RobotModel, pose: Pose2) -> float:
        """Return the distance in m from the robot's footprint to the nearest surface; 0 or negative in contact."""
        if robot.radius is not None:
            return float(self.distance(np.array([[pose.x, pose.y]]))[0]) - robot.radius
        corners = np.array(robot.footprint)
        t = np.linspace(0, 1, 21)[:, None]
        outline = np.concatenate([a + t * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
        return float(self.distance(pose.apply(outline)).min())


@dataclass
class Drive:
    """Simulated drive of a robot that a stack controls, with perfect odometry and a noisy lidar.

    world:          obstacles
    pose:           true pose
    beams:          number of beams of the lidar
    field_of_view:  angle in rad that the beams cover
    noise:          standard deviation of ranges in m
    range_max:      maximum range of the lidar in m
    tick:           current tick
    twist:          true velocity in the base frame
    is_blind:       whether the lidar returns no scans
    odometry:       names of the odometry sensors

    The recorded values are `log` (events of the stack), `track` (true poses), `commands`, `plans`, and `min_clearance`
    (minimum clearance in m).
    """

    world: Flatland
    robot: RobotModel
    stack: Stack
    pose: Pose2
    beams: int = 360
    field_of_view: float = 2 * math.pi
    noise: float = 0.01
    range_max: float = 12.0
    tick: int = 0
    twist: Twist = STOP
    is_blind: bool = False
    odometry: tuple[str, ...] = ("ground_truth", "odom")

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(1)
        self.log: list[Event] = []
        self.track: list[Pose2] = [self.pose]
        self.commands: list[Twist] = []
        self.plans: list[Path] = []
        self.min_clearance = math.inf

    def run(self, seconds: float, until: str = "navigation.ended") -> "Drive":
        """Simulate `seconds`, or less if the stack reports an event of the kind `until`. Return this drive.

        With `until` "", no event ends the simulation.
        """
        end = self.tick + round(seconds * TICK_RATE_HZ)
        while self.tick < end:
            if any(event.kind == until for event in self.step()):
                break
        return self

    def step(self) -> tuple[Event, ...]:
        """Simulate one odometry period, and return the events that the stack reports."""
        readings: list[Reading] = []
        if self.tick % ODOMETRY_PERIOD_TICKS == 0:
            readings += [Odometry(name, self.tick, self.pose, self.twist) for name in self.odometry]
        if self.tick % SCAN_PERIOD_TICKS == 0 and not self.is_blind:
            readings.append(self.scan())
        decision = self.stack.decide(self.tick, tuple(readings))
        self.log += decision.events
        self.commands.append(decision.command)
        if decision.plan is not None:
            self.plans.append(decision.plan)
        self._move(decision.command, ODOMETRY_PERIOD_TICKS / TICK_RATE_HZ)
        self.tick += ODOMETRY_PERIOD_TICKS
        return decision.events

    def scan(self) -> Scan:
        """Return the noisy scan at the current pose."""
        is_full_circle = self.field_of_view >= 2 * math.pi - 1e-9
        step = self.field_of_view / (self.beams if is_full_circle else self.beams - 1)
        first = -self.field_of_view / 2
        angles = first + step * np.arange(self.beams, dtype=np.float64) + self.pose.yaw
        ranges = self.world.cast((self.pose.x, self.pose.y), angles)
        ranges = np.round(ranges + self.rng.normal(0, self.noise, len(ranges)), 3)
        ranges[ranges > self.range_max] = np.inf
        return Scan("lidar", self.tick, ranges, first, step, 0.05, self.range_max)

    def _move(self, command: Twist, dt: float) -> None:
        """Move the robot by `dt` seconds within its acceleration limits."""
        r = self.robot
        limit = r.linear_deceleration if abs(command.vx) < abs(self.twist.vx) else r.linear_acceleration
        vx = self.twist.vx + np.clip(command.vx - self.twist.vx, -limit * dt, limit * dt)
        vy = self.twist.vy + np.clip(command.vy - self.twist.vy, -limit * dt, limit * dt)
        turn = r.angular_acceleration * dt
        wz = self.twist.wz + np.clip(command.wz - self.twist.wz, -turn, turn)
        self.twist = Twist(float(vx), float(vy), float(wz))
        middle = self.pose.yaw + wz * dt / 2
        self.pose = Pose2(
            float(self.pose.x + (vx * math.cos(middle) - vy * math.sin(middle)) * dt),
            float(self.pose.y + (vx * math.sin(middle) + vy * math.cos(middle)) * dt),
            math.remainder(float(self.pose.yaw + wz * dt), 2 * math.pi),
        )
        self.track.append(self.pose)
        self.min_clearance = min(self.min_clearance, self.world.clearance(self.robot, self.pose))

    def events_of_kind(self, kind: str) -> list[Event]:
        """Return the events of this kind so far."""
        return [event for event in self.log if event.kind == kind]

    @property
    def result(self) -> str:
        """Result of the navigation, such as "SUCCEEDED"; "" before its end."""
        return self.events_of_kind("navigation.ended")[-1].name if self.events_of_kind("navigation.ended") else ""


def drive(
    world: Flatland,
    start: Pose2,
    *goals: Goal,
    robot: RobotModel | None = None,
    grid: OccupancyGrid | None = None,
    spec: StackSpec | None = None,
    seed: int = 1,
    stop_on_failure: bool = True,
    **options: Any,
) -> Drive:
    """Return a drive from `start` to the goals, before the first step.

    `grid` is the map; None for mapless navigation. The default `spec` is a stack that knows the true poses. `options`
    are fields of Drive.
    """
    from simscen.stack.build import build_stack

    robot = robot or round_robot()
    spec = spec or StackSpec(localizer=GroundTruth(type="ground_truth"))
    surroundings = Surroundings(robot, grid, TICK_RATE_HZ, lidars=("lidar",))
    stack = build_stack(spec, surroundings, Streams(seed), Clock(TICK_RATE_HZ), stop_on_failure=stop_on_failure)
    stack.start(Estimate(start), goals)
    return Drive(world, robot, stack, start, **options)
