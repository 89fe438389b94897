"""Short drives of a whole stack, step by step: where each of its parameters shows."""

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
"""Tells, step by step, all that the stack decides."""
Change = Callable[[int, Readings], Readings]
A_SECOND = 40


class Told:
    """Remembers what a stack decided, whose readings may be others than the world's."""

    def __init__(self, inner: Any, change: Change = lambda _tick, readings: readings) -> None:
        self.inner, self.change = inner, change
        self.last: object = None

    def decide(self, tick: int, readings: Readings) -> Decision:
        decision: Decision = self.inner.decide(tick, self.change(tick, readings))
        self.last = plain(decision)
        return decision


def plain(value: Any) -> object:
    """Something that is equal exactly where the values are."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if is_dataclass(value):
        return tuple(plain(getattr(value, each.name)) for each in fields(value))
    if isinstance(value, tuple):
        return tuple(plain(each) for each in value)
    return repr(value)


def steps(d: Drive, seconds: float) -> Iterator[object]:
    """Drive on, and tell what was decided."""
    for _ in range(round(seconds * A_SECOND)):
        d.step()
        assert isinstance(d.stack, Told)
        yield d.stack.last


@cache
def mapped(boxes: Boxes = ()) -> OccupancyGrid:
    """The map of a room of 5 x 4 m with a wall that leaves a door of 1 m, and of these boxes."""
    return room(*boxes).grid((-0.3, -0.3, 5.3, 4.3))


def room(*boxes: tuple[float, float, float, float]) -> Flatland:
    world = Flatland().room(5, 4)
    world.boxes += [(2.9, 0.0, 3.0, 1.5), (2.9, 2.5, 3.0, 4.0), *boxes]
    return world


def begin(
    world: Flatland, start: Pose2, spec: StackSpec, *goals: Pose2, change: Change | None = None, **options: Any
) -> Drive:
    """A drive with few beams, on the map of the empty room unless told otherwise."""
    grid = options.pop("grid", mapped())
    named = [Goal(f"goal {number}", goal) for number, goal in enumerate(goals)]
    d = drive(world, start, *named, spec=spec, grid=grid, **{"beams": 120, "stop_on_failure": True, **options})
    d.stack = Told(d.stack, *([change] if change else []))  # type: ignore[assignment]
    return d


def pushed(d: Drive, *ways: tuple[float, Twist]) -> Iterator[object]:
    """Whatever the stack says, the robot moves so long with each of these velocities."""
    for seconds, twist in ways:

        def move(_command: Twist, dt: float, twist: Twist = twist) -> None:
            d.twist = twist
            d.pose = d.pose.compose(Pose2(twist.vx * dt, twist.vy * dt, twist.wz * dt))

        d._move = move  # type: ignore[method-assign]
        yield from steps(d, seconds)


# Driving


def through(spec: StackSpec) -> Iterator[object]:
    """Through the door, past things that are not on the map: one, and a row that touches at corners only."""
    row = tuple((1.6 + 0.05 * i, 2.85 + 0.05 * i, 1.64 + 0.05 * i, 2.89 + 0.05 * i) for i in range(3))
    world = room((2.0, 0.9, 2.3, 1.2), *row, (1.2, 1.0, 1.22, 1.02))
    yield from steps(begin(world, Pose2(0.8, 1.6), spec, Pose2(4.2, 2.8, 1.0)), 5.0)


def arriving(spec: StackSpec) -> Iterator[object]:
    """A short way to a goal with another heading."""
    yield from steps(begin(room(), Pose2(0.8, 1.6), spec, Pose2(1.5, 1.7, 0.8)), 5.0)


def drifting_past(spec: StackSpec) -> Iterator[object]:
    """The robot comes near its goal and turns there, and is pushed off as far as the tolerance before it has turned."""
    d = begin(room(), Pose2(0.9, 1.6), spec, Pose2(1.5, 1.6, 1.0))
    yield from pushed(d, (1.0, Twist(0.55, 0.0, 0.0)), (0.3, Twist(-0.45, 0.0, 0.0)), (2.0, Twist(0.0, 0.0, 0.5)))


def stuck(spec: StackSpec) -> Iterator[object]:
    """The robot creeps and turns, wherever it is told to go; then it stands."""
    d = begin(room(), Pose2(0.8, 1.6), spec, Pose2(2.5, 1.6))
    yield from pushed(d, (1.6, Twist(0.25, 0.0, 0.4)), (1.4, Twist()))


def two_ways(spec: StackSpec) -> Iterator[object]:
    """A robot that does not move, before a narrow gap and a longer way that is wider."""
    wall = ((1.6, 0.0, 1.7, 1.3), (1.6, 1.9, 1.7, 3.1))
    yield from pushed(begin(room(*wall), Pose2(0.8, 1.6), spec, Pose2(2.5, 1.6), grid=mapped(wall)), (0.6, Twist()))


def shut(spec: StackSpec) -> Iterator[object]:
    """The door is shut, and something stands close behind the robot; later it opens."""
    door = (2.9, 1.5, 3.0, 2.5)
    world = room(door, (0.9, 1.4, 1.0, 2.6))
    d = begin(world, Pose2(1.45, 2.0), spec, Pose2(4.0, 2.0))
    yield from steps(d, 9.0)
    world.boxes.remove(door)
    yield from steps(d, 3.0)


def wedged(spec: StackSpec) -> Iterator[object]:
    """The door is shut before a long robot, which has little room to turn."""
    world = room((2.9, 1.5, 3.0, 2.5), (1.4, 2.33, 1.6, 2.4))
    yield from steps(begin(world, Pose2(1.3, 2.0), spec, Pose2(4.0, 2.0), robot=box_robot(0.8, 0.3)), 4.0)


def in_a_corridor(spec: StackSpec) -> Iterator[object]:
    """Something shuts a corridor in which a long robot that came a meter cannot turn; later it goes."""
    door = (2.9, 1.5, 3.0, 2.5)
    world = room((0.0, 2.3, 2.9, 2.4), (0.0, 1.6, 2.9, 1.7))
    d = begin(world, Pose2(0.8, 2.0), spec, Pose2(4.0, 2.0), robot=box_robot(0.8, 0.3, 1.0))
    yield from steps(d, 2.0)
    world.boxes.append(door)
    yield from steps(d, 9.0)
    world.boxes.remove(door)
    yield from steps(d, 2.0)


def walled_in(spec: StackSpec) -> Iterator[object]:
    """The goal is near a wall, in one, or off the map; or the robot is."""
    inside, outside, wall = Pose2(1.0, 2.0), Pose2(9.0, 1.0), Pose2(2.95, 0.8)
    for start, goal in (
        (inside, Pose2(0.1, 1.0)),
        (inside, wall),
        (wall, inside),
        (inside, outside),
        (outside, inside),
    ):
        yield from steps(begin(room(), start, spec, goal), 0.3)


def seen_by_one(spec: StackSpec) -> Iterator[object]:
    """Something stands in the way that is not on the map."""
    yield from steps(begin(room((1.7, 1.3, 1.8, 2.7)), Pose2(0.9, 2.0), spec, Pose2(2.4, 2.0)), 4.0)


def silent(spec: StackSpec) -> Iterator[object]:
    """The lidar falls silent for a while."""
    d = begin(room(), Pose2(0.8, 2.0), spec, Pose2(2.4, 2.0))
    yield from steps(d, 0.5)
    d.is_blind = True
    yield from steps(d, 1.2)


def crossed(spec: StackSpec) -> Iterator[object]:
    """Two things come along, one of them slow."""
    world = room()
    world.discs += [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)]
    d = begin(world, Pose2(0.8, 2.0), spec, Pose2(2.5, 2.0), beams=360)
    for step in range(round(4 * A_SECOND)):
        t = step / A_SECOND
        world.discs[-2:] = [(2.7 - 0.6 * t, 2.1, 0.2), (1.7, 0.6 + 0.35 * t, 0.15)]
        yield from steps(d, 1 / A_SECOND)


# Costmaps


def no_map(spec: StackSpec) -> Iterator[object]:
    """Nothing but a wall that comes into sight and goes away; a goal beyond the window."""
    world = Flatland([(1.2, -0.6, 1.3, 0.6)])
    d = begin(world, Pose2(0.0, 0.0), spec, Pose2(13.0, 0.0), grid=None, range_max=3.5)
    yield from steps(d, 1.0)
    world.boxes.clear()
    yield from steps(d, 2.0)


class Camera:
    """A depth picture: a box that is 8 cm high, a lamp that hangs 0.85 m above the ground, and a ramp on the right."""

    def __init__(self) -> None:
        depth = np.full((24, 32), np.inf, np.float32)
        depth[19:22, 12:20], depth[0:2, 4:10] = 0.7, 1.2
        down = (np.arange(12, 24) - 11.5) / (16 / np.tan(0.6))
        depth[12:, 24:] = (0.328 / (down + 0.14))[:, None]
        self._image = Image("camera", 0, np.zeros((24, 32, 3), np.uint8), depth, Pose3(0.1, 0.0, 0.3), 1.2)

    def __call__(self, tick: int, readings: Readings) -> Readings:
        return (*readings, replace(self._image, tick=tick)) if tick % 24 == 0 else readings


def seen_by_a_camera(spec: StackSpec) -> Iterator[object]:
    """What only a camera sees is in the way."""
    yield from steps(begin(room(), Pose2(0.8, 2.0), spec, Pose2(2.4, 2.0), change=Camera()), 1.0)


# Localization


def slipping(share: float, bias: float) -> Change:
    """Wheels that report so much of the way, and a gyroscope with a bias that lags behind what turns."""

    def change(tick: int, readings: Readings) -> Readings:
        told: list[Reading] = []
        for each in readings:
            if isinstance(each, Odometry):
                pose = Pose2(share * each.pose.x, share * each.pose.y, each.pose.yaw)
                told.append(replace(each, pose=pose))
                told.append(Imu("imu", tick, (0.0, 0.0, 0.9 * each.twist.wz + bias), (0.0, 0.0, 9.8)))
            else:
                told.append(each)
        return tuple(told)

    return change


WAY = (
    (0.4, Twist()), (1.0, Twist(0.5, 0.0, 0.0)), (0.6, Twist(0.0, 0.0, 0.8)), (1.2, Twist(0.4, 0.1, -0.7)),
    (0.8, Twist(0.4, 0.0, 0.3)),
)  # fmt: skip


def moved(spec: StackSpec) -> Iterator[object]:
    """A robot that is driven about a room of which a part has changed, with a lidar that does not see far."""
    options = {
        "odometry": ("odom",),
        "beams": 72,
        "noise": 0.03,
        "range_max": 3.2,
        "robot": round_robot(max_lateral=0.3),
    }
    d = begin(room((0.5, 2.6, 0.8, 2.9)), Pose2(1.0, 1.6), spec, change=slipping(0.95, 0.01), **options)
    yield from pushed(d, *WAY)


def slipped(spec: StackSpec) -> Iterator[object]:
    """Wheels that say half of the way, and a lidar whose scans can be matched."""
    d = begin(room(), Pose2(0.9, 1.6), spec, change=slipping(0.6, 0.02), odometry=("odom",), beams=180)
    yield from pushed(d, *WAY)


def kidnapped(spec: StackSpec) -> Iterator[object]:
    """A robot that is carried elsewhere, which its odometry does not tell."""
    here, there = Pose2(0.9, 1.6), Pose2(4.2, 3.0, 2.0)
    told = Pose2(0.0, 0.0)

    def change(_tick: int, readings: Readings) -> Readings:
        return tuple(
            replace(each, pose=told.compose(each.pose)) if isinstance(each, Odometry) else each for each in readings
        )

    d = begin(room(), here, spec, change=change, odometry=("odom",), beams=72)
    yield from pushed(d, (0.5, Twist(0.3, 0.0, 0.0)), (0.5, Twist(-0.3, 0.0, 0.0)))
    told, d.pose = d.pose.compose(there.inverse()), there
    yield from pushed(d, *WAY)


def unknown(spec: StackSpec) -> Iterator[object]:
    """A robot that is not told where it is."""
    d = begin(room((0.5, 2.6, 0.8, 2.9)), Pose2(0.9, 1.6), spec, odometry=("odom",), beams=72)
    assert isinstance(d.stack, Told)
    d.stack.inner.start(Estimate(None), ())
    yield from pushed(d, *WAY)


# Planning


def planned(spec: StackSpec) -> Iterator[object]:
    """A plan past a box that is on the map."""
    box = ((1.6, 1.5, 2.0, 2.4),)
    yield from steps(begin(room(*box), Pose2(0.8, 2.0), spec, Pose2(4.2, 2.2, 1.0), grid=mapped(box)), 0.1)


def half_known(spec: StackSpec) -> Iterator[object]:
    """The map does not know what is between the robot and its goal."""
    cells = mapped().cells.copy()
    cells[:, 60:66] = np.where(cells[:, 60:66] == 0, -1, cells[:, 60:66])
    grid = OccupancyGrid(cells, mapped().resolution, mapped().origin)
    yield from steps(begin(room(), Pose2(0.8, 2.0), spec, Pose2(4.2, 2.2, 1.0), grid=grid, range_max=1.0), 0.2)


def at_a_wall(spec: StackSpec) -> Iterator[object]:
    """A goal nearer to a wall than the robot can be."""
    for away in (0.2, 0.1):
        yield from steps(begin(room(), Pose2(1.0, 2.0), spec, Pose2(away, 1.0)), 0.2)


def long_way(spec: StackSpec) -> Iterator[object]:
    """A way of some seconds, on which plans may be made anew: it ends more than 4 m away."""
    yield from steps(begin(room(), Pose2(0.4, 0.5), spec, Pose2(4.6, 3.6, 1.0)), 2.5)
