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
Scene = Callable[[StackSpec], Iterator[object]]
"""Drives with the stack of a specification, and yields each of its decisions in a form that can be compared."""
Change = Callable[[int, Readings], Readings]
STEPS_PER_S = 40


class RecordingStack:
    """Stack that remembers its last decision. `change` can replace its readings."""

    def __init__(self, inner: Any, change: Change = lambda _tick, readings: readings) -> None:
        self.inner, self.change = inner, change
        self.last: object = None

    def decide(self, tick: int, readings: Readings) -> Decision:
        decision: Decision = self.inner.decide(tick, self.change(tick, readings))
        self.last = comparable(decision)
        return decision


def comparable(value: Any) -> object:
    """Return an object that is equal to that of another value if both values are equal."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if is_dataclass(value):
        return tuple(comparable(getattr(value, each.name)) for each in fields(value))
    if isinstance(value, tuple):
        return tuple(comparable(each) for each in value)
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
    """Return a room of 5 x 4 m with a wall that has a door of 1 m, and with boxes (min x, min y, max x, max y)."""
    world = Flatland().room(5, 4)
    world.boxes += [(2.9, 0.0, 3.0, 1.5), (2.9, 2.5, 3.0, 4.0), *boxes]
    return world


def begin(
    world: Flatland, start: Pose2, spec: StackSpec, *goals: Pose2, change: Change | None = None, **options: Any
) -> Drive:
    """Return a drive with few lidar beams. The map is that of the room without boxes, unless `grid` is given."""
    grid = options.pop("grid", room_map())
    named = [Goal(f"goal {number}", goal) for number, goal in enumerate(goals)]
    d = drive(world, start, *named, spec=spec, grid=grid, **{"beams": 120, "stop_on_failure": True, **options})
    d.stack = RecordingStack(d.stack, *([change] if change else []))  # type: ignore[assignment]
    return d


def move_robot(d: Drive, *motions: tuple[float, Twist]) -> Iterator[object]:
    """Ignore the commands of the stack, and move the robot by pairs (duration in s, velocity); yield decisions."""
    for seconds, twist in motions:

        def move(_command: Twist, dt: float, twist: Twist = twist) -> None:
            d.twist = twist
            d.pose = d.pose.compose(Pose2(twist.vx * dt, twist.vy * dt, twist.wz * dt))

        d._move = move  # type: ignore[method-assign]
        yield from steps(d, seconds)


# Driving


def through_door(spec: StackSpec) -> Iterator[object]:
    """Drive through the door, past a box and a row of boxes that touch at corners only, which are not on the map."""
    row = tuple((1.6 + 0.05 * i, 2.85 + 0.05 * i, 1.64 + 0.05 * i, 2.89 + 0.05 * i) for i in range(3))
    world = room((2.0, 0.9, 2.3, 1.2), *row, (1.2, 1.0, 1.22, 1.02))
    yield from steps(begin(world, Pose2(0.8, 1.6), spec, Pose2(4.2, 2.8, 1.0)), 5.0)


def arrival(spec: StackSpec) -> Iterator[object]:
    """Drive a short distance to a goal with another heading."""
    yield from steps(begin(room(), Pose2(0.8, 1.6), spec, Pose2(1.5, 1.7, 0.8)), 5.0)


def overshoot_goal(spec: StackSpec) -> Iterator[object]:
    """Move the robot past its goal and back, up to the tolerance, before it turns to the heading of the goal."""
    d = begin(room(), Pose2(0.9, 1.6), spec, Pose2(1.5, 1.6, 1.0))
    yield from move_robot(d, (1.0, Twist(0.55, 0.0, 0.0)), (0.3, Twist(-0.45, 0.0, 0.0)), (2.0, Twist(0.0, 0.0, 0.5)))


def no_progress(spec: StackSpec) -> Iterator[object]:
    """Move the robot slowly on a curve, and then stop it."""
    d = begin(room(), Pose2(0.8, 1.6), spec, Pose2(2.5, 1.6))
    yield from move_robot(d, (1.6, Twist(0.25, 0.0, 0.4)), (1.4, Twist()))


def gap_and_detour(spec: StackSpec) -> Iterator[object]:
    """Hold the robot in front of a narrow gap to the goal, and of a wide detour."""
    wall = ((1.6, 0.0, 1.7, 1.3), (1.6, 1.9, 1.7, 3.1))
    yield from move_robot(
        begin(room(*wall), Pose2(0.8, 1.6), spec, Pose2(2.5, 1.6), grid=room_map(wall)), (0.6, Twist())
    )


def closed_door(spec: StackSpec) -> Iterator[object]:
    """Drive to a closed door, with a box close behind the robot. Later, the door opens."""
    door = (2.9, 1.5, 3.0, 2.5)
    world = room(door, (0.9, 1.4, 1.0, 2.6))
    d = begin(world, Pose2(1.45, 2.0), spec, Pose2(4.0, 2.0))
    yield from steps(d, 9.0)
    world.boxes.remove(door)
    yield from steps(d, 3.0)


def little_room_to_turn(spec: StackSpec) -> Iterator[object]:
    """Drive a long robot, which has little room to turn, to a closed door."""
    world = room((2.9, 1.5, 3.0, 2.5), (1.4, 2.33, 1.6, 2.4))
    yield from steps(begin(world, Pose2(1.3, 2.0), spec, Pose2(4.0, 2.0), robot=box_robot(0.8, 0.3)), 4.0)


def blocked_corridor(spec: StackSpec) -> Iterator[object]:
    """Close the end of a corridor in which a long robot cannot turn, after it has driven 1 m, and open it later."""
    door = (2.9, 1.5, 3.0, 2.5)
    world = room((0.0, 2.3, 2.9, 2.4), (0.0, 1.6, 2.9, 1.7))
    d = begin(world, Pose2(0.8, 2.0), spec, Pose2(4.0, 2.0), robot=box_robot(0.8, 0.3, 1.0))
    yield from steps(d, 2.0)
    world.boxes.append(door)
    yield from steps(d, 9.0)
    world.boxes.remove(door)
    yield from steps(d, 2.0)


def invalid_start_or_goal(spec: StackSpec) -> Iterator[object]:
    """Plan to goals near a wall, in a wall, and outside of the map, and from such starts."""
    inside, outside, wall = Pose2(1.0, 2.0), Pose2(9.0, 1.0), Pose2(2.95, 0.8)
    for start, goal in (
        (inside, Pose2(0.1, 1.0)),
        (inside, wall),
        (wall, inside),
        (inside, outside),
        (outside, inside),
    ):
        yield from steps(begin(room(), start, spec, goal), 0.3)


def obstacle_not_on_map(spec: StackSpec) -> Iterator[object]:
    """Drive towards an obstacle that is not on the map."""
    yield from steps(begin(room((1.7, 1.3, 1.8, 2.7)), Pose2(0.9, 2.0), spec, Pose2(2.4, 2.0)), 4.0)


def lidar_outage(spec: StackSpec) -> Iterator[object]:
    """Drive while the lidar sends no scans for some time."""
    d = begin(room(), Pose2(0.8, 2.0), spec, Pose2(2.4, 2.0))
    yield from steps(d, 0.5)
    d.is_blind = True
    yield from steps(d, 1.2)


def moving_obstacles(spec: StackSpec) -> Iterator[object]:
    """Drive while two discs move through the room, one of them slowly."""
    world = room()
    world.discs += [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)]
    d = begin(world, Pose2(0.8, 2.0), spec, Pose2(2.5, 2.0), beams=360)
    for step in range(round(4 * STEPS_PER_S)):
        t = step / STEPS_PER_S
        world.discs[-2:] = [(2.7 - 0.6 * t, 2.1, 0.2), (1.7, 0.6 + 0.35 * t, 0.15)]
        yield from steps(d, 1 / STEPS_PER_S)


# Costmaps


def without_map(spec: StackSpec) -> Iterator[object]:
    """Drive without a map to a goal outside of the costmap. A wall is removed during the drive."""
    world = Flatland([(1.2, -0.6, 1.3, 0.6)])
    d = begin(world, Pose2(0.0, 0.0), spec, Pose2(13.0, 0.0), grid=None, range_max=3.5)
    yield from steps(d, 1.0)
    world.boxes.clear()
    yield from steps(d, 2.0)


class Camera:
    """Adds a depth image: a box 8 cm high, a lamp 0.85 m above the ground, and a ramp on the right."""

    def __init__(self) -> None:
        depth = np.full((24, 32), np.inf, np.float32)
        depth[19:22, 12:20], depth[0:2, 4:10] = 0.7, 1.2
        down = (np.arange(12, 24) - 11.5) / (16 / np.tan(0.6))
        depth[12:, 24:] = (0.328 / (down + 0.14))[:, None]
        self._image = Image("camera", 0, np.zeros((24, 32, 3), np.uint8), depth, Pose3(0.1, 0.0, 0.3), 1.2)

    def __call__(self, tick: int, readings: Readings) -> Readings:
        return (*readings, replace(self._image, tick=tick)) if tick % 24 == 0 else readings


def obstacles_in_depth_image(spec: StackSpec) -> Iterator[object]:
    """Drive towards obstacles that only a depth camera sees."""
    yield from steps(begin(room(), Pose2(0.8, 2.0), spec, Pose2(2.4, 2.0), change=Camera()), 1.0)


# Localization


def slipping(fraction: float, bias: float) -> Change:
    """Return a change of the readings: odometry with a fraction of the distance, and a biased gyroscope."""

    def change(tick: int, readings: Readings) -> Readings:
        changed: list[Reading] = []
        for each in readings:
            if isinstance(each, Odometry):
                pose = Pose2(fraction * each.pose.x, fraction * each.pose.y, each.pose.yaw)
                changed.append(replace(each, pose=pose))
                changed.append(Imu("imu", tick, (0.0, 0.0, 0.9 * each.twist.wz + bias), (0.0, 0.0, 9.8)))
            else:
                changed.append(each)
        return tuple(changed)

    return change


MOTIONS = (
    (0.4, Twist()), (1.0, Twist(0.5, 0.0, 0.0)), (0.6, Twist(0.0, 0.0, 0.8)), (1.2, Twist(0.4, 0.1, -0.7)),
    (0.8, Twist(0.4, 0.0, 0.3)),
)  # fmt: skip


def changed_room(spec: StackSpec) -> Iterator[object]:
    """Move the robot in a room that differs from the map, with a lidar of short range."""
    options = {
        "odometry": ("odom",),
        "beams": 72,
        "noise": 0.03,
        "range_max": 3.2,
        "robot": round_robot(max_lateral=0.3),
    }
    d = begin(room((0.5, 2.6, 0.8, 2.9)), Pose2(1.0, 1.6), spec, change=slipping(0.95, 0.01), **options)
    yield from move_robot(d, *MOTIONS)


def wheel_slip(spec: StackSpec) -> Iterator[object]:
    """Move the robot with odometry that reports 60 % of the distance, and with enough beams for scan matching."""
    d = begin(room(), Pose2(0.9, 1.6), spec, change=slipping(0.6, 0.02), odometry=("odom",), beams=180)
    yield from move_robot(d, *MOTIONS)


def kidnapped(spec: StackSpec) -> Iterator[object]:
    """Move the robot to another place without a change of its odometry."""
    here, there = Pose2(0.9, 1.6), Pose2(4.2, 3.0, 2.0)
    offset = Pose2(0.0, 0.0)

    def change(_tick: int, readings: Readings) -> Readings:
        return tuple(
            replace(each, pose=offset.compose(each.pose)) if isinstance(each, Odometry) else each for each in readings
        )

    d = begin(room(), here, spec, change=change, odometry=("odom",), beams=72)
    yield from move_robot(d, (0.5, Twist(0.3, 0.0, 0.0)), (0.5, Twist(-0.3, 0.0, 0.0)))
    offset, d.pose = d.pose.compose(there.inverse()), there
    yield from move_robot(d, *MOTIONS)


def unknown_start(spec: StackSpec) -> Iterator[object]:
    """Move the robot with an unknown initial pose."""
    d = begin(room((0.5, 2.6, 0.8, 2.9)), Pose2(0.9, 1.6), spec, odometry=("odom",), beams=72)
    assert isinstance(d.stack, RecordingStack)
    d.stack.inner.start(Estimate(None), ())
    yield from move_robot(d, *MOTIONS)


# Planning


def plan_past_box(spec: StackSpec) -> Iterator[object]:
    """Plan past a box that is on the map."""
    box = ((1.6, 1.5, 2.0, 2.4),)
    yield from steps(begin(room(*box), Pose2(0.8, 2.0), spec, Pose2(4.2, 2.2, 1.0), grid=room_map(box)), 0.1)


def unknown_cells(spec: StackSpec) -> Iterator[object]:
    """Plan through cells that are unknown on the map."""
    cells = room_map().cells.copy()
    cells[:, 60:66] = np.where(cells[:, 60:66] == 0, -1, cells[:, 60:66])
    grid = OccupancyGrid(cells, room_map().resolution, room_map().origin)
    yield from steps(begin(room(), Pose2(0.8, 2.0), spec, Pose2(4.2, 2.2, 1.0), grid=grid, range_max=1.0), 0.2)


def goal_near_wall(spec: StackSpec) -> Iterator[object]:
    """Plan to goals nearer to a wall than the robot can be."""
    for away in (0.2, 0.1):
        yield from steps(begin(room(), Pose2(1.0, 2.0), spec, Pose2(away, 1.0)), 0.2)


def replan_on_long_path(spec: StackSpec) -> Iterator[object]:
    """Drive for some seconds to a goal more than 4 m away, so that plans can be replaced."""
    yield from steps(begin(room(), Pose2(0.4, 0.5), spec, Pose2(4.6, 3.6, 1.0)), 2.5)
