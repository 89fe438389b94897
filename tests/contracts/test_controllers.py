"""Every controller keeps the promises of simscen.stack.protocols.Controller."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "stack"))
from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.core.navigation import ErrorCode, Goal
from simscen.core.navigation import Path as Plan
from simscen.model.stack import Controller as Spec
from simscen.model.stack import Costmap as CostmapSpec
from simscen.model.stack import DynamicWindow, Mppi, RegulatedPurePursuit
from simscen.stack.arcs import poses_along
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import Controller, CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import RATE, Flatland, box_robot, round_robot, setting

PERIOD = 0.05
SPECS: dict[str, Spec] = {
    "regulated_pure_pursuit": RegulatedPurePursuit(),
    "rpp without regulation": RegulatedPurePursuit(
        use_regulated_linear_velocity_scaling=False, use_cost_regulated_linear_velocity_scaling=False,
        use_velocity_scaled_lookahead_dist=False, use_rotate_to_heading=False,
    ),
    "dwb": DynamicWindow(type="dwb"),
    "mppi": Mppi(type="mppi", batch_size=400),
}  # fmt: skip
ROBOTS = {"round": round_robot(), "long": box_robot(speed=0.8)}
every = pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)
each_robot = pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
GOAL = Goal("g", Pose2(7.0, 3.0, 1.0))
STRAIGHT = Plan(np.column_stack((np.arange(1.0, 7.01, 0.05), np.full(121, 3.0), np.zeros(121))))


def view_of(robot: RobotModel, *discs: tuple[float, float, float]) -> CostmapView:
    world = Flatland(discs=list(discs)).room(9, 6)
    return Costmap(CostmapSpec(), Surroundings(robot, world.grid((-0.5, -0.5, 9.5, 6.5)), RATE)).view


def controller(spec: Spec, robot: RobotModel, view: CostmapView) -> Controller:
    built = spec.implementation()(spec, setting(robot))
    built.set_path(STRAIGHT)
    return built


def follow(built: Controller, view: CostmapView, robot: RobotModel, pose: Pose2, seconds: float) -> list[Pose2]:
    """A base that does at once what it is told."""
    track, twist = [pose], Twist()
    for _ in range(round(seconds / PERIOD)):
        twist = built.command(track[-1], twist, view, GOAL)
        track.append(Pose2(*poses_along(track[-1], twist, np.array([PERIOD]))[0].tolist()))
    return track


@every
@each_robot
def test_it_follows_the_path_to_its_end_and_turns_to_the_goals_heading(spec: Spec, robot: RobotModel) -> None:
    view = view_of(robot)
    track = follow(controller(spec, robot, view), view, robot, Pose2(1.0, 3.1, 0.0), 40)
    assert track[-1].distance(GOAL.pose) < 0.25
    assert abs(track[-1].yaw - 1.0) < 0.25
    assert max(abs(pose.y - 3.0) for pose in track) < 0.3


@every
@each_robot
def test_no_command_exceeds_the_limits_of_the_base(spec: Spec, robot: RobotModel) -> None:
    view = view_of(robot)
    chance = np.random.default_rng(3)
    for _ in range(30):
        built = controller(spec, robot, view)
        pose = Pose2(*chance.uniform((1, 2, -3), (6, 4, 3)).tolist())
        twist = Twist(float(chance.uniform(0, robot.max_linear)), 0.0, float(chance.uniform(-1, 1)))
        command = built.command(pose, twist, view, GOAL)
        assert -robot.max_reverse <= command.vx <= robot.max_linear
        assert abs(command.wz) <= robot.max_angular + 1e-9
        assert command.vy == 0.0


@every
def test_a_speed_limit_is_kept_and_lifted(spec: Spec) -> None:
    robot = ROBOTS["round"]
    view = view_of(robot)
    built = controller(spec, robot, view)
    built.set_speed_limit(0.15)
    fastest = max(built.command(Pose2(2.0, 3.0), Twist(0.15), view, GOAL).vx for _ in range(20))
    assert 0.05 < fastest <= 0.15 + 1e-6
    built.set_speed_limit(None)
    assert max(built.command(Pose2(2.0, 3.0), Twist(0.4), view, GOAL).vx for _ in range(20)) > 0.2


@every
@each_robot
@pytest.mark.parametrize("gap", [0.02, 0.1, 0.3, 0.6])
def test_what_it_is_about_to_drive_is_free_or_it_fails_with_no_valid_control(
    spec: Spec, robot: RobotModel, gap: float
) -> None:
    front = max(x for x, _ in robot.footprint)
    view = view_of(robot, (2.0 + front + gap + 0.5, 3.0, 0.5))
    footprint = Footprint(robot, view.resolution)
    built = controller(spec, robot, view)
    pose = Pose2(2.0, 3.0, 0.0)
    try:
        for _ in range(5):
            command = built.command(pose, Twist(), view, GOAL)
    except NavigationFailure as failure:
        assert failure.code == ErrorCode.NO_VALID_CONTROL
    else:
        assert footprint.free(view, poses_along(pose, command, np.linspace(0, 0.5, 11))).all()


@every
@each_robot
def test_it_never_drives_into_a_wall_across_its_path(spec: Spec, robot: RobotModel) -> None:
    view = view_of(robot, *((4.0, y, 0.3) for y in np.arange(0.0, 6.1, 0.3)))
    footprint = Footprint(robot, view.resolution)
    built, pose, twist = controller(spec, robot, view), Pose2(1.0, 3.0, 0.0), Twist()
    for _ in range(200):
        try:
            twist = built.command(pose, twist, view, GOAL)
        except NavigationFailure as failure:
            assert failure.code == ErrorCode.NO_VALID_CONTROL
            twist = Twist()
        pose = Pose2(*poses_along(pose, twist, np.array([PERIOD]))[0].tolist())
        assert footprint.free(view, np.array([pose]))[0]


@every
def test_the_same_calls_give_the_same_commands_bit_for_bit(spec: Spec) -> None:
    robot = ROBOTS["round"]
    view = view_of(robot, (4.0, 3.3, 0.2))
    one, other = (follow(controller(spec, robot, view), view, robot, Pose2(1, 3), 2.0) for _ in range(2))
    assert one == other


@every
def test_an_empty_path_is_an_invalid_path(spec: Spec) -> None:
    robot = ROBOTS["round"]
    with pytest.raises(NavigationFailure) as failed:
        controller(spec, robot, view_of(robot)).set_path(Plan())
    assert failed.value.code == ErrorCode.INVALID_PATH


@every
def test_path_and_costmap_are_not_changed(spec: Spec) -> None:
    robot = ROBOTS["round"]
    view = view_of(robot)
    points, costs = STRAIGHT.points.copy(), view.costs.copy()
    built = controller(spec, robot, view)
    built.command(Pose2(1, 3), Twist(), view, GOAL)
    assert np.array_equal(STRAIGHT.points, points)
    assert np.array_equal(view.costs, costs)
    assert built.local_plan is not None
