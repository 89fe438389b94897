"""Tests of whole drives among moving obstacles."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from simscen.advanced.prediction import avoidance
from simscen.advanced.prediction.avoidance import Avoidance
from simscen.advanced.prediction.rollouts import FollowedPath
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Goal
from simscen.model.controllers import DynamicWindow, RegulatedPurePursuit
from simscen.model.costmaps import Costmap
from simscen.model.guards import CollisionMonitor as CollisionMonitorSpec
from simscen.model.guards import Prediction
from simscen.model.localizers import GroundTruth
from simscen.model.mppi import Mppi
from simscen.model.stack import StackSpec
from simscen.model.stack_base import ControllerSpec
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.moving_obstacles import MovingObstacles
from simscen.stack.protocols import CostmapView, RobotModel
from simscen.testing.flatland import TICK_RATE_HZ, Drive, Flatland, box_robot, drive

Disc = tuple[float, float, float]
FAR = Goal("far", Pose2(10.0, 0.0), xy_tolerance=0.3)
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


def among(d: Drive, discs: Callable[[float], list[Disc]], seconds: float, until: str = "navigation.ended") -> Drive:
    """Drive on while these move."""
    end = d.tick + round(seconds * TICK_RATE_HZ)
    while d.tick < end:
        d.world.discs = discs(d.tick / TICK_RATE_HZ)
        if any(event.kind == until for event in d.step()):
            break
    return d


def oncoming(t: float) -> list[Disc]:
    return [(11.0 - 1.2 * t, 0.05, 0.4)]


def crossing(t: float) -> list[Disc]:
    """Would meet a robot of 1 m/s in the middle of its way, and another one a little later."""
    return [(4.0, -5.0 + 1.2 * t, 0.4), (7.0, 9.0 - 1.2 * t, 0.4)]


@pytest.mark.sample(1)
@pytest.mark.parametrize("controller", CONTROLLERS, ids=lambda spec: str(spec.type))
@pytest.mark.parametrize("discs", [oncoming, crossing])
def test_every_controller_avoids_oncoming_and_crossing_obstacles(
    controller: ControllerSpec, discs: Callable[[float], list[Disc]]
) -> None:
    d = among(start(FAR, controller=controller), discs, 30.0)
    assert d.result == "SUCCEEDED"
    assert d.min_clearance > 0.1


def test_without_prediction_the_robot_collides() -> None:
    d = among(start(FAR, enabled=False), oncoming, 30.0)
    assert d.min_clearance < 0.1


def test_robot_at_its_goal_evades_and_returns() -> None:
    goal = Goal("here", Pose2(1.0, 0.0), xy_tolerance=0.25)
    d = among(start(goal), lambda _: [], 10.0)
    assert d.result == "SUCCEEDED"
    stood, began = d.pose, d.tick / TICK_RATE_HZ

    def through(t: float) -> list[Disc]:
        return [(stood.x + 0.05, stood.y - 6.0 + 1.0 * (t - began), 0.4)]

    d.min_clearance = math.inf
    farthest = 0.0
    for _ in range(20):
        among(d, through, 1.0)
        farthest = max(farthest, d.pose.distance(stood))
    assert d.min_clearance > 0.05
    assert farthest > 0.4
    assert d.pose.distance(goal.pose) < goal.xy_tolerance
    assert abs(d.pose.yaw - stood.yaw) < 0.25
    assert d.commands[-1] == STOP


def test_canceled_robot_does_not_evade() -> None:
    d = among(start(FAR), lambda _: [], 1.0)
    d.stack.cancel(d.tick)
    told = len(d.commands)
    among(d, lambda t: [(d.pose.x, 6.0 - 1.0 * t, 0.4)], 3.0, until="never")
    assert set(d.commands[told:]) == {STOP}


def test_moving_obstacle_leaves_no_trail_in_the_costmap() -> None:
    d = among(start(FAR), lambda t: [(3.0 + 0.9 * t, -3.0 + 0.8 * t, 0.4)], 6.0)
    reasons = {event.data["reason"] for event in d.events_of_kind("plan.made")}
    assert reasons == {"goal"}  # never: blocked, nor led around it


def test_prediction_has_no_effect_without_moving_obstacles() -> None:
    """Except for the first moments, in which motion cannot be detected yet."""
    world = Flatland(discs=[(2.0, 0.3, 0.3), (4.0, -0.3, 0.2), (2.5, 3.0, 0.05)])
    slow, near = RegulatedPurePursuit(desired_linear_vel=0.5), Goal("near", Pose2(3.5, 0.5), xy_tolerance=0.3)
    with_it, without = (start(near, controller=slow, enabled=on, world=world).run(15.0) for on in (True, False))
    assert with_it.result == "SUCCEEDED"
    assert with_it.commands == without.commands


@pytest.mark.parametrize("robot", [box_robot(), box_robot(length=1.0, width=0.4)], ids=["all but round", "long"])
def test_pruned_search_finds_the_cheapest_candidate(robot: RobotModel, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    costmap = CostmapView(np.zeros((200, 200), np.uint8), np.full((200, 200), 2.0, np.float32), 0.05, (-5.0, -5.0))
    costmap.distance[:, 120:] = np.maximum(2.0 - 0.05 * np.arange(80), 0.0)
    path = FollowedPath(np.column_stack((np.arange(0.0, 8.0, 0.05), np.zeros(160))))
    given = list[list[Twist]]()
    drawn = [(rng.normal(0, 2, (3, 2)), rng.normal(0, 1, (3, 2)), rng.uniform(0, 1, 3)) for _ in range(24)]
    for at_once in (avoidance.BATCH_SIZE, 10**6):
        monkeypatch.setattr(avoidance, "BATCH_SIZE", at_once)
        avoids, commands = Avoidance(Prediction(), robot, 1.0), list[Twist]()
        for places, speeds, (x, vx, wz) in drawn:
            moving = MovingObstacles(places, speeds, np.full(3, 0.3), np.tile(0.01 * np.eye(4), (3, 1, 1)), 1.0)
            wanted, twist = Twist(1.0, 0.0, 0.1), Twist(float(vx), 0.0, float(wz))
            commands.append(avoids.steer(wanted, Pose2(float(x), 0.1, 0.2), twist, moving, costmap, path))
        given.append(commands)
    assert given[0] == given[1]
    assert sum(command != Twist(1.0, 0.0, 0.1) for command in given[0]) > 6


def test_the_collision_monitor_brakes_by_the_relative_velocity_and_only_where_braking_helps() -> None:
    robot = box_robot()
    monitor = CollisionMonitor(CollisionMonitorSpec(), robot, (), TICK_RATE_HZ)
    still = np.zeros((1, 4, 4))

    def told(x: float, y: float, vx: float, vy: float) -> float:
        monitor.on_moving(MovingObstacles(np.array([[x, y]]), np.array([[vx, vy]]), np.array([0.5]), still, 1.0))
        return monitor.allow(Twist(1.0, 0.0, 0.0), Pose2(0.0, 0.0)).vx

    assert told(1.0, 0.0, 1.0, 0.0) == 1.0  # it goes as fast as the robot
    standing = told(1.0, 0.0, 0.0, 0.0)
    assert standing == pytest.approx(0.27 / 0.5, abs=0.13)  # it stands, 0.27 s ahead
    assert told(1.0, 0.0, -1.0, 0.0) < standing  # it comes
    assert told(0.8, -1.2, 0.0, 1.2) < 1.0  # it crosses, and would be hit
    assert told(-1.0, 0.0, 1.5, 0.0) == 1.0  # it comes from behind: standing would be worse
    assert told(1.0, 0.0, -4.0, 0.0) < 0.5  # it comes as soon to a robot that stands, but no nearer
    assert told(0.0, 0.9, 0.0, -1.5) == 1.0  # it comes from the side: to go on is as good as to stand
