"""Tests of the local costmap: jumps of the localizer, rolling, size, inherited parameters, zones, and clearing."""

import math
from itertools import pairwise

import numpy as np
import pytest

from simscen.core.environment.costmap_filters import Zones
from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.core.messages.sensor_data import Odometry, Readings
from simscen.core.records.trace import Decision
from simscen.model.costmaps import Costmap, LocalCostmap
from simscen.model.localizers import GroundTruth
from simscen.model.stack import StackSpec
from simscen.model.velocity_commands import CollisionMonitor
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.frames import Frames
from simscen.stack.odometry_history import OdometryHistory
from simscen.stack.protocols import CostmapView, Surroundings
from simscen.testing.flatland import CONTROL_PERIOD_TICKS, TICK_RATE_HZ, Drive, Flatland, drive, round_robot

TRUTH = GroundTruth(type="ground_truth")
CORRIDOR = Flatland().room(14, 1.6)
START, GOAL = Pose2(1.0, 0.8), Goal("g", Pose2(12.0, 0.8), timeout=60.0)


class JumpingLocalizer:
    """Stack wrapper that adds a jump to the localizer's pose from `at` s on, but not to the odometry."""

    def __init__(self, drive: Drive, at: float, jump: Pose2) -> None:
        self.stack, self._at, self._jump = drive.stack, at * TICK_RATE_HZ, jump

    def decide(self, tick: int, readings: Readings) -> Decision:
        return self.stack.decide(
            tick, tuple(self._add_jump(reading) if tick >= self._at else reading for reading in readings)
        )

    def _add_jump(self, reading: object) -> object:
        if not isinstance(reading, Odometry) or reading.sensor != "ground_truth":
            return reading
        return Odometry(reading.sensor, reading.tick, self._jump.compose(reading.pose), reading.twist)


def drive_with_jump(jump: Pose2, seconds: float) -> Drive:
    """Return a drive along a corridor in which the localizer jumps after three seconds."""
    d = drive(CORRIDOR, START, GOAL, grid=CORRIDOR.grid((-0.5, -0.5, 14.5, 2.1)))
    d.stack = JumpingLocalizer(d, 3.0, jump)
    return d.run(seconds)


def costmaps(d: Drive) -> Costmaps:
    stack = d.stack.stack if isinstance(d.stack, JumpingLocalizer) else d.stack
    return stack.inner._costmaps


def lethal_points(view: CostmapView) -> np.ndarray:
    """Return the centers (n, 2) of the lethal cells."""
    cells = np.argwhere(view.costs == 254)
    return (cells[:, ::-1] + 0.5) * view.resolution + view.origin


@pytest.mark.parametrize("jump", [Pose2(0.0, 0.3), Pose2(0.0, -0.3), Pose2(0.3, 0.0), Pose2(0.0, 0.0, 0.05)])
def test_localizer_jump_changes_neither_local_costmap_nor_command(jump: Pose2) -> None:
    d = drive_with_jump(jump, 4.5)
    # In this drive, the odom frame is the true frame.
    wall_distances = CORRIDOR.distance(lethal_points(costmaps(d).local_costmap.view))
    assert len(wall_distances) > 50
    assert np.abs(wall_distances).max() < 0.1
    robot, period = d.robot, CONTROL_PERIOD_TICKS / TICK_RATE_HZ
    commands = d.commands[TICK_RATE_HZ * 5 // 2 // 6 :]
    for before, after in pairwise(commands):
        assert abs(after.vx - before.vx) <= max(robot.linear_acceleration, robot.linear_deceleration) * period + 1e-9
        assert abs(after.wz - before.wz) <= robot.angular_acceleration * period + 1e-9


def test_robot_follows_its_plan_at_the_corrected_pose_after_a_jump() -> None:
    """After a jump of 0.1 m to the left, the robot drives 0.1 m to the right."""
    d = drive_with_jump(Pose2(0.0, 0.1), 12.0)
    assert d.track[-1].y == pytest.approx(0.7, abs=0.03)


def test_local_costmap_rolls_with_the_robot_without_the_map() -> None:
    mapped = Flatland([*CORRIDOR.boxes, (3.0, 0.0, 3.1, 0.3)])
    d = drive(CORRIDOR, START, GOAL, grid=mapped.grid((-0.5, -0.5, 14.5, 2.1))).run(4.0)
    view = costmaps(d).local_costmap.view
    height, width = view.costs.shape
    middle = view.origin[0] + width * view.resolution / 2, view.origin[1] + height * view.resolution / 2
    assert math.dist(middle, d.pose[:2]) < 0.4
    assert np.abs(CORRIDOR.distance(lethal_points(view))).max() < 0.1
    assert (mapped.distance(lethal_points(costmaps(d).global_costmap.view)) < 0.05).all()


def test_local_costmap_has_the_size_and_resolution_of_nav2_or_the_given_values() -> None:
    def shape(**options: float) -> tuple[tuple[int, int], float]:
        spec = StackSpec(localizer=TRUTH, local_costmap=LocalCostmap(**options))
        view = costmaps(drive(CORRIDOR, START, GOAL, grid=None, spec=spec)).local_costmap.view
        return view.costs.shape, view.resolution

    assert shape() == ((60, 60), 0.05)
    assert shape(width=5.0, height=2.0) == ((40, 100), 0.05)
    assert shape(width=4.0, resolution=0.1) == ((30, 40), 0.1)


def test_local_costmap_of_a_fast_robot_covers_its_lookahead() -> None:
    spec = StackSpec(localizer=TRUTH, controller={"type": "dwb", "max_vel_x": 3.0})
    fast = drive(CORRIDOR, START, GOAL, grid=None, robot=round_robot(speed=3.0), spec=spec)
    view = costmaps(fast).local_costmap.view
    assert view.costs.shape[1] * view.resolution / 2 > 1.7 * 3.0 + 0.22


def test_local_costmap_inherits_unset_parameters() -> None:
    shared = Costmap(inflation_radius=0.3, obstacle_max_range=1.0)
    expected = shared.model_copy(update={"publish_frequency": 1.0})
    assert LocalCostmap(track_unknown_space=True).with_defaults_from(shared) == expected
    overridden = LocalCostmap(inflation_radius=0.5, update_frequency=10.0).with_defaults_from(shared)
    assert (overridden.inflation_radius, overridden.obstacle_max_range, overridden.update_frequency) == (0.5, 1.0, 10.0)


def test_local_costmap_has_keepout_zones_at_their_estimated_position() -> None:
    d = drive(CORRIDOR, START, GOAL, grid=CORRIDOR.grid((-0.5, -0.5, 14.5, 2.1)))
    zone = ((3.0, 0.0), (3.4, 0.0), (3.4, 0.4), (3.0, 0.4))
    d.stack.inner.set_zones(0, Zones(keepout=(zone,)))
    d.stack = JumpingLocalizer(d, 3.0, Pose2(0.2, 0.0))
    for end_s, shift in ((2.9, 0.0), (4.0, 0.2)):
        d.run(end_s - d.tick / TICK_RATE_HZ)
        points = lethal_points(costmaps(d).local_costmap.view)
        inside = points[(points[:, 1] > 0.1) & (points[:, 1] < 0.38)]
        assert inside[:, 0].min() == pytest.approx(3.0 - shift, abs=0.06)
        assert inside[:, 0].max() == pytest.approx(3.4 - shift, abs=0.06)


def test_obstacles_behind_the_robot_outside_the_field_of_view_are_kept() -> None:
    """The robot has passed a post, which is 1 m behind the hull, in the blind sector of a lidar with 270 degrees."""
    world = Flatland(discs=[(2.0, 0.45, 0.05)])
    grid = Flatland().grid((-0.5, -2.0, 9.5, 2.0))
    d = drive(world, Pose2(0.5, 0.0), Goal("g", Pose2(8.0, 0.0)), grid=grid, field_of_view=1.5 * math.pi)
    while d.pose.x < 3.2:
        d.run(0.1)
    maps = costmaps(d)
    for clear in (maps.clear_local, maps.clear_around, maps.clear):
        clear()
        assert np.hypot(*(lethal_points(maps.local_costmap.view) - (2.0, 0.45)).T).min() < 0.1


def test_windows_and_zones_follow_a_robot_without_a_lidar() -> None:
    zone = ((4.0, -0.5), (5.0, -0.5), (5.0, 0.5), (4.0, 0.5))
    costmaps = Costmaps(StackSpec(), Surroundings(round_robot(), None, TICK_RATE_HZ, keepout=(zone,)), 0.5)
    odometry = OdometryHistory(TICK_RATE_HZ)
    for tick, x in enumerate((0.0, 1.0, 2.0, 3.0)):
        pose = Pose2(x, 0.0)
        odometry.add(tick, pose)
        costmaps.update(tick, Frames(pose, pose), odometry)
        for view in (costmaps.global_costmap.view, costmaps.local_costmap.view):
            half = view.costs.shape[1] * view.resolution / 2
            assert abs(view.origin[0] + half - x) <= half / 4 + view.resolution
    view = costmaps.local_costmap.view
    lethal = np.argwhere(view.costs == 254)
    assert lethal[:, 1].min() * view.resolution + view.origin[0] == pytest.approx(4.0, abs=0.06)


@pytest.mark.parametrize("mapped", [True, False])
def test_windows_follow_a_robot_whose_lidar_has_failed(mapped: bool) -> None:
    grid = CORRIDOR.grid((-0.5, -0.5, 14.5, 2.1)) if mapped else None
    spec = StackSpec(localizer=TRUTH, collision_monitor=CollisionMonitor(enabled=False))
    d = drive(CORRIDOR, START, GOAL, grid=grid, spec=spec).run(2.0)
    d.is_blind = True
    assert d.run(60.0).result == "SUCCEEDED"
    assert not d.events_of_kind("recovery.started")
