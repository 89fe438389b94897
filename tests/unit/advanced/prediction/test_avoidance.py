"""Tests of the avoidance of moving obstacles, most of them in whole drives."""

import cmath
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from simscen.advanced.prediction import avoidance
from simscen.advanced.prediction.avoidance import Avoidance
from simscen.advanced.prediction.followed_path import FollowedPath
from simscen.advanced.prediction.stand_position import StandPosition
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.model.controllers import DynamicWindow, RegulatedPurePursuit
from simscen.model.costmaps import Costmap, Prediction
from simscen.model.localizers import GroundTruth
from simscen.model.mppi import Mppi
from simscen.model.stack import StackSpec
from simscen.model.stack_base import ControllerSpec
from simscen.model.velocity_commands import CollisionMonitor as CollisionMonitorSpec
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.moving_obstacles import MovingObstacle, MovingObstacles
from simscen.stack.protocols import CostmapView, RobotModel
from simscen.testing.flatland import TICK_RATE_HZ, Drive, Flatland, box_robot, drive

Disc = tuple[float, float, float]
"""x, y, and radius in m."""
FAR_GOAL = Goal("far", Pose2(10.0, 0.0), xy_tolerance=0.3)
CONTROLLERS = [
    RegulatedPurePursuit(desired_linear_vel=1.0),
    Mppi(type="mppi", vx_max=1.0, batch_size=300),
    DynamicWindow(type="dwb", max_vel_x=1.0),
]


def start(
    *goals: Goal, controller: ControllerSpec | None = None, enabled: bool = True, world: Flatland | None = None
) -> Drive:
    spec = StackSpec(
        profile="advanced",
        localizer=GroundTruth(type="ground_truth"),
        costmap=Costmap(obstacle_max_range=8.0, raytrace_max_range=10.0, update_frequency=10.0),
        controller=controller or CONTROLLERS[0],
        prediction=Prediction(enabled=enabled),
    )
    return drive(world or Flatland(), Pose2(0.0, 0.0), *goals, robot=box_robot(), spec=spec, range_max=20.0)


def drive_among(
    d: Drive, discs: Callable[[float], list[Disc]], seconds: float, until: str = "navigation.ended"
) -> Drive:
    """Drive among the discs that `discs(t)` returns, for `seconds` or until an event of the kind `until`."""
    end = d.tick + round(seconds * TICK_RATE_HZ)
    while d.tick < end:
        d.world.discs = discs(d.tick / TICK_RATE_HZ)
        if any(event.kind == until for event in d.step()):
            break
    return d


def oncoming(t: float) -> list[Disc]:
    return [(11.0 - 1.2 * t, 0.05, 0.4)]


def crossing(t: float) -> list[Disc]:
    """Return two discs that cross the path of a robot at 1 m/s one after the other."""
    return [(4.0, -5.0 + 1.2 * t, 0.4), (7.0, 9.0 - 1.2 * t, 0.4)]


@pytest.mark.sample(1)
@pytest.mark.parametrize("controller", CONTROLLERS, ids=lambda spec: str(spec.type))
@pytest.mark.parametrize("discs", [oncoming, crossing])
def test_every_controller_avoids_oncoming_and_crossing_obstacles(
    controller: ControllerSpec, discs: Callable[[float], list[Disc]]
) -> None:
    d = drive_among(start(FAR_GOAL, controller=controller), discs, 30.0)
    assert d.result == "SUCCEEDED"
    assert d.min_clearance > 0.1


def test_without_prediction_the_robot_collides() -> None:
    d = drive_among(start(FAR_GOAL, enabled=False), oncoming, 30.0)
    assert d.min_clearance < 0.1


def test_robot_at_its_goal_evades_and_returns() -> None:
    goal = Goal("here", Pose2(1.0, 0.0), xy_tolerance=0.25)
    d = drive_among(start(goal), lambda _: [], 10.0)
    assert d.result == "SUCCEEDED"
    arrived_at, start_s = d.pose, d.tick / TICK_RATE_HZ

    def crossing_disc(t: float) -> list[Disc]:
        return [(arrived_at.x + 0.05, arrived_at.y - 6.0 + 1.0 * (t - start_s), 0.4)]

    d.min_clearance = math.inf
    farthest = 0.0
    for _ in range(20):
        drive_among(d, crossing_disc, 1.0)
        farthest = max(farthest, d.pose.distance(arrived_at))
    assert d.min_clearance > 0.05
    assert farthest > 0.4
    assert d.pose.distance(goal.pose) < goal.xy_tolerance
    assert abs(d.pose.yaw - arrived_at.yaw) < 0.25
    assert d.commands[-1] == STOP


def test_canceled_robot_does_not_evade() -> None:
    d = drive_among(start(FAR_GOAL), lambda _: [], 1.0)
    d.stack.cancel(d.tick)
    count = len(d.commands)
    drive_among(d, lambda t: [(d.pose.x, 6.0 - 1.0 * t, 0.4)], 3.0, until="never")
    assert set(d.commands[count:]) == {STOP}


def test_moving_obstacle_leaves_no_trail_in_the_costmap() -> None:
    d = drive_among(start(FAR_GOAL), lambda t: [(3.0 + 0.9 * t, -3.0 + 0.8 * t, 0.4)], 6.0)
    reasons = {event.data["reason"] for event in d.events_of_kind("plan.made")}
    assert reasons == {"goal"}  # neither blocked nor replanned around the obstacle


def test_prediction_has_no_effect_without_moving_obstacles() -> None:
    world = Flatland(discs=[(2.0, 0.3, 0.3), (4.0, -0.3, 0.2), (2.5, 3.0, 0.05)])
    slow, near = RegulatedPurePursuit(desired_linear_vel=0.5), Goal("near", Pose2(3.5, 0.5), xy_tolerance=0.3)
    enabled, disabled = (start(near, controller=slow, enabled=on, world=world).run(15.0) for on in (True, False))
    assert enabled.result == "SUCCEEDED"
    assert enabled.commands == disabled.commands


@pytest.mark.parametrize("robot", [box_robot(), box_robot(length=1.0, width=0.4)], ids=["almost round", "long"])
def test_pruned_search_finds_the_cheapest_candidate(robot: RobotModel, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    costmap = CostmapView(np.zeros((200, 200), np.uint8), np.full((200, 200), 2.0, np.float32), 0.05, (-5.0, -5.0))
    costmap.distance[:, 120:] = np.maximum(2.0 - 0.05 * np.arange(80), 0.0)
    path = FollowedPath(np.column_stack((np.arange(0.0, 8.0, 0.05), np.zeros(160))))
    results = list[list[Twist]]()
    samples = [(rng.normal(0, 2, (3, 2)), rng.normal(0, 1, (3, 2)), rng.uniform(0, 1, 3)) for _ in range(24)]
    for batch_size in (avoidance.BATCH_SIZE, 10**6):
        monkeypatch.setattr(avoidance, "BATCH_SIZE", batch_size)
        avoidance_of_robot, commands = Avoidance(robot, 1.0), list[Twist]()
        for centers, velocities, (x, vx, wz) in samples:
            states = zip(centers, velocities, strict=True)
            moving = MovingObstacles(
                (MovingObstacle(complex(*xy), complex(*v), 0.3, 0.01, 0.0, 0.01) for xy, v in states), 1.0
            )
            desired, twist = Twist(1.0, 0.0, 0.1), Twist(float(vx), 0.0, float(wz))
            commands.append(avoidance_of_robot.steer(desired, Pose2(float(x), 0.1, 0.2), twist, moving, costmap, path))
        results.append(commands)
    assert results[0] == results[1]
    assert sum(command != Twist(1.0, 0.0, 0.1) for command in results[0]) > 6


def test_the_collision_monitor_brakes_by_the_relative_velocity_and_only_where_braking_helps() -> None:
    robot = box_robot()
    monitor = CollisionMonitor(CollisionMonitorSpec(), robot, (), TICK_RATE_HZ)

    def allowed_speed(x: float, y: float, vx: float, vy: float) -> float:
        monitor.set_moving_obstacles(
            MovingObstacles([MovingObstacle(complex(x, y), complex(vx, vy), 0.5, 0.0, 0.0, 0.0)], 1.0)
        )
        return monitor.limit_command(Twist(1.0, 0.0, 0.0), Pose2(0.0, 0.0)).vx

    assert allowed_speed(1.0, 0.0, 1.0, 0.0) == 1.0  # drives ahead at the speed of the robot
    at_rest = allowed_speed(1.0, 0.0, 0.0, 0.0)
    assert at_rest == pytest.approx(0.27 / 0.5, abs=0.13)  # static, 0.27 s ahead
    assert allowed_speed(1.0, 0.0, -1.0, 0.0) < at_rest  # approaches
    assert allowed_speed(0.8, -1.2, 0.0, 1.2) < 1.0  # crosses, with a collision
    assert allowed_speed(-1.0, 0.0, 1.5, 0.0) == 1.0  # approaches from behind, so braking would be worse
    assert allowed_speed(1.0, 0.0, -4.0, 0.0) < 0.5  # reaches a stopped robot as early, but at a greater distance
    assert allowed_speed(0.0, 0.9, 0.0, -1.5) == 1.0  # approaches from the side, so braking does not help


@pytest.mark.parametrize("heading", [0.0, 90.0, 180.0])
def test_sideways_command_is_changed_like_a_forward_command(heading: float) -> None:
    """An obstacle crosses the path of the moving robot, but would miss a robot at rest."""
    direction = cmath.rect(1.0, math.radians(heading))
    obstacle = MovingObstacle(direction * (1.4 + 1.0j), direction * -0.5j, 0.3, 1e-4, 0.0, 1e-3)
    moving = MovingObstacles([obstacle], Prediction().acceleration)
    costmap = CostmapView(np.zeros((200, 200), np.uint8), np.full((200, 200), 2.0, np.float32), 0.05, (-5.0, -5.0))
    robot = replace(box_robot(), max_lateral=0.6)
    commands = {"forward": Twist(0.5, 0.0, 0.0), "sideways": Twist(0.0, 0.5, 0.0), "rest": STOP}
    yaw = {"forward": 0.0, "sideways": -math.pi / 2, "rest": 0.0}
    is_kept = {
        name: Avoidance(robot, 0.6).steer(
            command, Pose2(0.0, 0.0, math.radians(heading) + yaw[name]), command, moving, costmap, None
        )
        is command
        for name, command in commands.items()
    }
    assert is_kept == {"forward": False, "sideways": False, "rest": True}


@pytest.mark.parametrize(("max_reverse", "speed"), [(0.1, -0.1), (1.0, -0.3), (0.0, 0.0)])
def test_robot_returns_to_its_position_within_its_reverse_speed(max_reverse: float, speed: float) -> None:
    position = StandPosition(replace(box_robot(), max_reverse=max_reverse), 1.0)
    position.remember(Pose2(0.0, 0.0), has_moving_obstacles=True)
    assert position.return_command(Pose2(1.0, 0.0)).vx == pytest.approx(speed)


def test_slow_robot_avoids_obstacles_within_its_speed() -> None:
    moving = MovingObstacles([MovingObstacle(-0.9 + 0.0j, 0.5 + 0.0j, 0.3, 1e-4, 0.0, 1e-3)], 1.0)
    costmap = CostmapView(np.zeros((200, 200), np.uint8), np.full((200, 200), 2.0, np.float32), 0.05, (-5.0, -5.0))
    avoidance_of_slow_robot = Avoidance(replace(box_robot(), max_linear=0.2), 0.2)
    command = avoidance_of_slow_robot.steer(STOP, Pose2(0.0, 0.0), STOP, moving, costmap, None)
    assert 0.0 < command.vx <= 0.2


@pytest.mark.parametrize(("limit", "is_reached"), [(math.inf, True), (0.15, False)])
def test_avoidance_keeps_the_limit_of_a_speed_zone(limit: float, is_reached: bool) -> None:
    moving = MovingObstacles([MovingObstacle(-0.9 + 0.0j, 0.5 + 0.0j, 0.3, 1e-4, 0.0, 1e-3)], 1.0)
    costmap = CostmapView(np.zeros((200, 200), np.uint8), np.full((200, 200), 2.0, np.float32), 0.05, (-5.0, -5.0))
    avoidance_of_robot = Avoidance(box_robot(), 1.0)
    command = avoidance_of_robot.steer(STOP, Pose2(0.0, 0.0), STOP, moving, costmap, None, max_speed=limit)
    assert (abs(command.vx) > 0.15) is is_reached
