"""Scenes: short drives with the reference stack in which its parameters have an effect."""

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Image, Imu, Odometry, Reading, Readings
from simscen.core.records.trace import Decision
from simscen.model.stack import StackSpec
from simscen.testing.flatland import Drive, Flatland, box_robot, drive, round_robot

Boxes = tuple[tuple[float, float, float, float], ...]
"""min x, min y, max x, max y of each box in m."""
Scene = Callable[[StackSpec], Iterator[object]]
"""Function that drives with the stack of a specification, and yields each decision as comparable tuples."""
Change = Callable[[int, Readings], Readings]
"""Function that replaces the readings of a tick before the stack receives them."""
STEPS_PER_S = 40


class RecordingStack:
    """Stack that remembers its last decision as comparable tuples. `change` can replace its readings."""

    def __init__(self, inner: Any, change: Change = lambda _tick, readings: readings) -> None:
        self.inner, self.change = inner, change
        self.last: object = None

    def decide(self, tick: int, readings: Readings) -> Decision:
        decision: Decision = self.inner.decide(tick, self.change(tick, readings))
        self.last = comparable(decision)
        return decision


def comparable(value: Any) -> object:
    """Convert the arrays and dataclasses of a value to tuples that can be compared with ==."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if is_dataclass(value):
        return tuple(comparable(getattr(value, field.name)) for field in fields(value))
    if isinstance(value, tuple):
        return tuple(comparable(item) for item in value)
    return repr(value)


def steps(d: Drive, seconds: float) -> Iterator[object]:
    """Drive for some seconds, and yield each decision."""
    for _ in range(round(seconds * STEPS_PER_S)):
        d.step()
        assert isinstance(d.stack, RecordingStack)
        yield d.stack.last


@cache
def room_map(boxes: Boxes = ()) -> OccupancyGrid:
    """Return the map of the room with these boxes."""
    return room(*boxes).grid((-0.3, -0.3, 5.3, 4.3))


def room(*boxes: tuple[float, float, float, float]) -> Flatland:
    """Return a room of 5 x 4 m with a wall that has a door of 1 m, and with boxes."""
    world = Flatland().room(5, 4)
    world.boxes += [(2.9, 0.0, 3.0, 1.5), (2.9, 2.5, 3.0, 4.0), *boxes]
    return world


def start_drive(
    world: Flatland, start: Pose2, spec: StackSpec, *goals: Pose2, change: Change | None = None, **options: Any
) -> Drive:
    """Return a drive with few lidar beams. The map is that of the room without boxes, unless `grid` is given."""
    grid = options.pop("grid", room_map())
    named_goals = [Goal(f"goal {number}", goal) for number, goal in enumerate(goals)]
    d = drive(world, start, *named_goals, spec=spec, grid=grid, **{"beams": 120, "stop_on_failure": True, **options})
    d.stack = RecordingStack(d.stack, *([change] if change else []))  # type: ignore[assignment]
    return d


def move_robot(d: Drive, *motions: tuple[float, Twist]) -> Iterator[object]:
    """Move the robot by pairs (duration in s, velocity) instead of the commands of the stack; yield its decisions."""
    for seconds, twist in motions:

        def move(_command: Twist, dt: float, twist: Twist = twist) -> None:
            d.twist = twist
            d.pose = d.pose.compose(Pose2(twist.vx * dt, twist.vy * dt, twist.wz * dt))

        d._move = move  # type: ignore[method-assign]
        yield from steps(d, seconds)


# Driving


def through_door(spec: StackSpec) -> Iterator[object]:
    """Drive through the door, past unmapped boxes; some of them touch only at their corners."""
    row = tuple((1.6 + 0.05 * i, 2.85 + 0.05 * i, 1.64 + 0.05 * i, 2.89 + 0.05 * i) for i in range(3))
    world = room((2.0, 0.9, 2.3, 1.2), *row, (1.2, 1.0, 1.22, 1.02))
    yield from steps(start_drive(world, Pose2(0.8, 1.6), spec, Pose2(4.2, 2.8, 1.0)), 5.0)


def arrival(spec: StackSpec) -> Iterator[object]:
    """Drive a short distance to a goal with another heading."""
    yield from steps(start_drive(room(), Pose2(0.8, 1.6), spec, Pose2(1.5, 1.7, 0.8)), 5.0)


def overshoot_goal(spec: StackSpec) -> Iterator[object]:
    """Move the robot past its goal and back, up to the tolerance, before it turns to the heading of the goal."""
    d = start_drive(room(), Pose2(0.9, 1.6), spec, Pose2(1.5, 1.6, 1.0))
    yield from move_robot(d, (1.0, Twist(0.55, 0.0, 0.0)), (0.3, Twist(-0.45, 0.0, 0.0)), (2.0, Twist(0.0, 0.0, 0.5)))


def no_progress(spec: StackSpec) -> Iterator[object]:
    """Move the robot slowly on a curve, and then stop it."""
    d = start_drive(room(), Pose2(0.8, 1.6), spec, Pose2(2.5, 1.6))
    yield from move_robot(d, (1.6, Twist(0.25, 0.0, 0.4)), (1.4, Twist()))


def gap_and_detour(spec: StackSpec) -> Iterator[object]:
    """Hold the robot in front of a narrow gap; a wide detour also leads to the goal."""
    wall = ((1.6, 0.0, 1.7, 1.3), (1.6, 1.9, 1.7, 3.1))
    yield from move_robot(
        start_drive(room(*wall), Pose2(0.8, 1.6), spec, Pose2(2.5, 1.6), grid=room_map(wall)), (0.6, Twist())
    )


def closed_door(spec: StackSpec) -> Iterator[object]:
    """Drive to a closed door, with a box close behind the robot. Later, the door opens."""
    door = (2.9, 1.5, 3.0, 2.5)
    world = room(door, (0.9, 1.4, 1.0, 2.6))
    d = start_drive(world, Pose2(1.45, 2.0), spec, Pose2(4.0, 2.0))
    yield from steps(d, 9.0)
    world.boxes.remove(door)
    yield from steps(d, 3.0)


def small_turning_space(spec: StackSpec) -> Iterator[object]:
    """Drive a long robot, which has little room to turn, to a closed door."""
    world = room((2.9, 1.5, 3.0, 2.5), (1.4, 2.33, 1.6, 2.4))
    yield from steps(start_drive(world, Pose2(1.3, 2.0), spec, Pose2(4.0, 2.0), robot=box_robot(0.8, 0.3)), 4.0)


def blocked_corridor(spec: StackSpec) -> Iterator[object]:
    """Drive a long robot into a corridor in which it cannot turn. Its end is closed after 1 m, and opened later."""
    door = (2.9, 1.5, 3.0, 2.5)
    world = room((0.0, 2.3, 2.9, 2.4), (0.0, 1.6, 2.9, 1.7))
    d = start_drive(world, Pose2(0.8, 2.0), spec, Pose2(4.0, 2.0), robot=box_robot(0.8, 0.3, 1.0))
    yield from steps(d, 2.0)
    world.boxes.append(door)
    yield from steps(d, 9.0)
    world.boxes.remove(door)
    yield from steps(d, 2.0)


def invalid_start_or_goal(spec: StackSpec) -> Iterator[object]:
    """Plan to goals near a wall, in a wall, and outside of the map, and from starts in a wall and outside."""
    inside, outside, wall = Pose2(1.0, 2.0), Pose2(9.0, 1.0), Pose2(2.95, 0.8)
    for start, goal in (
        (inside, Pose2(0.1, 1.0)),
        (inside, wall),
        (wall, inside),
        (inside, outside),
        (outside, inside),
    ):
        yield from steps(start_drive(room(), start, spec, goal), 0.3)


def obstacle_not_on_map(spec: StackSpec) -> Iterator[object]:
    """Drive toward an obstacle that is not on the map."""
    yield from steps(start_drive(room((1.7, 1.3, 1.8, 2.7)), Pose2(0.9, 2.0), spec, Pose2(2.4, 2.0)), 4.0)


def lidar_outage(spec: StackSpec) -> Iterator[object]:
    """Drive while the lidar sends no scans for some time."""
    d = start_drive(room(), Pose2(0.8, 2.0), spec, Pose2(2.4, 2.0))
    yield from steps(d, 0.5)
    d.is_blind = True
    yield from steps(d, 1.2)


def moving_obstacles(spec: StackSpec) -> Iterator[object]:
    """Drive while two discs move through the room, one of them slowly."""
    world = room()
    world.discs += [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)]
    d = start_drive(world, Pose2(0.8, 2.0), spec, Pose2(2.5, 2.0), beams=360)
    for step in range(round(4 * STEPS_PER_S)):
        t = step / STEPS_PER_S
        world.discs[-2:] = [(2.7 - 0.6 * t, 2.1, 0.2), (1.7, 0.6 + 0.35 * t, 0.15)]
        yield from steps(d, 1 / STEPS_PER_S)


# Costmaps


def without_map(spec: StackSpec) -> Iterator[object]:
    """Drive without a map to a goal outside of the costmap. A wall is removed during the drive."""
    world = Flatland([(1.2, -0.6, 1.3, 0.6)])
    d = start_drive(world, Pose2(0.0, 0.0), spec, Pose2(13.0, 0.0), grid=None, range_max=3.5)
    yield from steps(d, 1.0)
    world.boxes.clear()
    yield from steps(d, 2.0)


class DepthCamera:
    """Change that adds a depth image with a box 8 cm high, a lamp 0.85 m above the ground, and a ramp on the right."""

    def __init__(self) -> None:
        depth = np.full((24, 32), np.inf, np.float32)
        depth[19:22, 12:20], depth[0:2, 4:10] = 0.7, 1.2
        down = (np.arange(12, 24) - 11.5) / (16 / np.tan(0.6))
        depth[12:, 24:] = (0.328 / (down + 0.14))[:, None]
        self._image = Image("camera", 0, np.zeros((24, 32, 3), np.uint8), depth, Pose3(0.1, 0.0, 0.3), 1.2)

    def __call__(self, tick: int, readings: Readings) -> Readings:
        return (*readings, replace(self._image, tick=tick)) if tick % 24 == 0 else readings


def obstacles_in_depth_image(spec: StackSpec) -> Iterator[object]:
    """Drive toward obstacles that are visible only to a depth camera."""
    yield from steps(start_drive(room(), Pose2(0.8, 2.0), spec, Pose2(2.4, 2.0), change=DepthCamera()), 1.0)


# Localization


def slip_odometry(distance_ratio: float, gyro_bias: float) -> Change:
    """Return a change that scales the distance of odometry, and adds a gyroscope with a bias in rad/s."""

    def change(tick: int, readings: Readings) -> Readings:
        changed: list[Reading] = []
        for reading in readings:
            if isinstance(reading, Odometry):
                pose = Pose2(distance_ratio * reading.pose.x, distance_ratio * reading.pose.y, reading.pose.yaw)
                changed.append(replace(reading, pose=pose))
                changed.append(Imu("imu", tick, (0.0, 0.0, 0.9 * reading.twist.wz + gyro_bias), (0.0, 0.0, 9.8)))
            else:
                changed.append(reading)
        return tuple(changed)

    return change


MOTIONS = (
    (0.4, Twist()), (1.0, Twist(0.5, 0.0, 0.0)), (0.6, Twist(0.0, 0.0, 0.8)), (1.2, Twist(0.4, 0.1, -0.7)),
    (0.8, Twist(0.4, 0.0, 0.3)),
)  # fmt: skip


def changed_room(spec: StackSpec) -> Iterator[object]:
    """Move the robot in a room with an unmapped box, with a lidar of short range."""
    options = {
        "odometry": ("odom",),
        "beams": 72,
        "noise": 0.03,
        "range_max": 3.2,
        "robot": round_robot(max_lateral=0.3),
    }
    d = start_drive(room((0.5, 2.6, 0.8, 2.9)), Pose2(1.0, 1.6), spec, change=slip_odometry(0.95, 0.01), **options)
    yield from move_robot(d, *MOTIONS)


def wheel_slip(spec: StackSpec) -> Iterator[object]:
    """Move the robot with odometry that reports 60 % of the distance, and with enough beams for scan matching."""
    d = start_drive(room(), Pose2(0.9, 1.6), spec, change=slip_odometry(0.6, 0.02), odometry=("odom",), beams=180)
    yield from move_robot(d, *MOTIONS)


def kidnapping(spec: StackSpec) -> Iterator[object]:
    """Move the robot to another place without a change of its odometry."""
    start, target = Pose2(0.9, 1.6), Pose2(4.2, 3.0, 2.0)
    offset = Pose2(0.0, 0.0)

    def change(_tick: int, readings: Readings) -> Readings:
        return tuple(
            replace(reading, pose=offset.compose(reading.pose)) if isinstance(reading, Odometry) else reading
            for reading in readings
        )

    d = start_drive(room(), start, spec, change=change, odometry=("odom",), beams=72)
    yield from move_robot(d, (0.5, Twist(0.3, 0.0, 0.0)), (0.5, Twist(-0.3, 0.0, 0.0)))
    offset, d.pose = d.pose.compose(target.inverse()), target
    yield from move_robot(d, *MOTIONS)


def unknown_start(spec: StackSpec) -> Iterator[object]:
    """Move the robot with an unknown initial pose."""
    d = start_drive(room((0.5, 2.6, 0.8, 2.9)), Pose2(0.9, 1.6), spec, odometry=("odom",), beams=72)
    assert isinstance(d.stack, RecordingStack)
    d.stack.inner.start(Estimate(None), ())
    yield from move_robot(d, *MOTIONS)


# Planning


def plan_past_box(spec: StackSpec) -> Iterator[object]:
    """Plan past a box that is on the map."""
    box = ((1.6, 1.5, 2.0, 2.4),)
    yield from steps(start_drive(room(*box), Pose2(0.8, 2.0), spec, Pose2(4.2, 2.2, 1.0), grid=room_map(box)), 0.1)


def unknown_cells(spec: StackSpec) -> Iterator[object]:
    """Plan through cells that are unknown on the map."""
    cells = room_map().cells.copy()
    cells[:, 60:66] = np.where(cells[:, 60:66] == 0, -1, cells[:, 60:66])
    grid = OccupancyGrid(cells, room_map().resolution, room_map().origin)
    yield from steps(start_drive(room(), Pose2(0.8, 2.0), spec, Pose2(4.2, 2.2, 1.0), grid=grid, range_max=1.0), 0.2)


def goal_near_wall(spec: StackSpec) -> Iterator[object]:
    """Plan to goals that are closer to a wall than the radius of the robot."""
    for x in (0.2, 0.1):
        yield from steps(start_drive(room(), Pose2(1.0, 2.0), spec, Pose2(x, 1.0)), 0.2)


def replan_on_long_path(spec: StackSpec) -> Iterator[object]:
    """Drive for some seconds to a goal more than 4 m away, so that plans can be replaced."""
    yield from steps(start_drive(room(), Pose2(0.4, 0.5), spec, Pose2(4.6, 3.6, 1.0)), 2.5)
