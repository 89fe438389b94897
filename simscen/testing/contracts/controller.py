"""Contract of controllers: checks that every controller must pass."""

from __future__ import annotations

import math

import numpy as np

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.footprint import Footprint
from simscen.stack.kinematics import arc_poses, poses_along
from simscen.stack.protocols import Controller, CostmapView, NavigationFailure, RobotModel
from simscen.testing.contracts.base import (
    ComponentContract,
    are_equal_costmaps,
    call_component,
    copy_costmap,
    costmap_of_world,
    overwrite_costmap,
    promise,
    require,
)
from simscen.testing.flatland import Flatland

PERIOD_S = 0.05
"""Time between two commands."""
GOAL = Goal("g", Pose2(7.0, 3.0, 1.0))
PATH_POINTS = np.column_stack((np.arange(1.0, 7.01, 0.05), np.full(121, 3.0), np.zeros(121)))
"""Poses (121, 3) of the straight path to GOAL."""
SPEED_TOLERANCE = 1e-6
"""Maximum excess of a command over a limit by rounding errors, in m/s and rad/s."""
GOAL_TOLERANCE, DWELL_S = 0.25, 3.0
"""Maximum error at the goal in m and rad, and time at the goal after which a drive ends."""


class ControllerContract(ComponentContract):
    """Contract of a controller on a straight path of 6 m through a room of 9 m by 6 m."""

    role = "controller"

    def view(self, *discs: tuple[float, float, float]) -> CostmapView:
        """Return the costmap of the room with round obstacles (x, y, radius)."""
        return costmap_of_world(Flatland(discs=list(discs)).room(9, 6), self.robot, (-0.5, -0.5, 9.5, 6.5))

    def controller_on_path(self) -> Controller:
        """Build a controller, and send it the path PATH_POINTS."""
        controller: Controller = self.build()
        call_component("receives a path", lambda: controller.set_path(Path(PATH_POINTS.copy())))
        return controller

    def command(self, controller: Controller, pose: Pose2, twist: Twist, view: CostmapView) -> Twist:
        """Return the command at this pose and velocity, checked by `checked_command`."""
        command = call_component("computes a command", lambda: controller.command(pose, twist, view, GOAL))
        return checked_command(command, self.robot)

    def drive(self, controller: Controller, view: CostmapView, pose: Pose2, seconds: float) -> list[Pose2]:
        """Return the poses of a robot that follows the commands exactly, from `pose` on.

        The drive ends after DWELL_S at the goal, or after `seconds`.
        """
        track, twist, periods_at_goal = [pose], Twist(), 0
        for _ in range(round(seconds / PERIOD_S)):
            twist = self.command(controller, track[-1], twist, view)
            track.append(move(track[-1], twist))
            periods_at_goal = periods_at_goal + 1 if is_at_goal(track[-1]) else 0
            if periods_at_goal * PERIOD_S >= DWELL_S:
                break
        return track

    @promise
    def it_follows_the_path_to_its_end_and_turns_to_the_goals_heading(self) -> None:
        """Given a free path then the robot ends at the goal pose, and deviates from the path by at most 0.3 m."""
        track = self.drive(self.controller_on_path(), self.view(), Pose2(1.0, 3.1, 0.0), 40)
        distance, turn = track[-1].distance(GOAL.pose), abs(wrap(track[-1].yaw - GOAL.pose.yaw))
        require(distance < GOAL_TOLERANCE, f"ends {distance:.2f} m from the end of the path after 40 s")
        require(turn < GOAL_TOLERANCE, f"ends {turn:.2f} rad from the goal's heading after 40 s")
        deviation = max(abs(pose.y - 3.0) for pose in track)
        require(deviation < 0.3, f"deviates from the path by {deviation:.2f} m")

    @promise
    def no_command_exceeds_the_limits_of_the_base(self) -> None:
        """Given any pose and velocity then no command exceeds the limits of the robot."""
        view, rng = self.view(), np.random.default_rng(3)
        for _ in range(30):
            pose = Pose2(*rng.uniform((1, 2, -3), (6, 4, 3)).tolist())
            twist = Twist(float(rng.uniform(0, self.robot.max_linear)), 0.0, float(rng.uniform(-1, 1)))
            self.command(self.controller_on_path(), pose, twist, view)

    @promise
    def a_speed_limit_is_kept_and_lifted(self) -> None:
        """Given a speed limit then no command is faster; given no limit then the robot drives at full speed again."""
        controller, view = self.controller_on_path(), self.view()
        require(
            math.isfinite(controller.full_speed) and controller.full_speed > 0, f"full speed {controller.full_speed!r}"
        )
        controller.set_speed_limit(0.15)
        slow = max(self.command(controller, Pose2(2.0, 3.0), Twist(0.15), view).vx for _ in range(20))
        require(slow <= 0.15 + SPEED_TOLERANCE, f"drives at {slow:.3f} m/s under a limit of 0.15 m/s")
        require(slow > 0.05, f"drives at no more than {slow:.3f} m/s under a limit of 0.15 m/s")
        controller.set_speed_limit(None)
        fast = max(self.command(controller, Pose2(2.0, 3.0), Twist(0.4), view).vx for _ in range(20))
        require(fast > min(0.2, 0.9 * controller.full_speed), f"drives at no more than {fast:.3f} m/s without a limit")

    @promise
    def a_command_is_collision_free_or_it_fails_with_no_valid_control(self) -> None:
        """Given an obstacle ahead then the command is collision-free for 0.5 s, or the error is NO_VALID_CONTROL."""
        front = max(x for x, _ in self.robot.footprint)
        footprint, pose = Footprint(self.robot, 0.05), Pose2(2.0, 3.0, 0.0)
        for gap in (0.02, 0.1, 0.3, 0.6):
            view, controller = self.view((2.0 + front + gap + 0.5, 3.0, 0.5)), self.controller_on_path()
            try:
                for _ in range(5):
                    command = self.command(controller, pose, Twist(), view)
            except NavigationFailure as failure:
                require_no_valid_control(failure)
            else:
                is_free = footprint.free(view, poses_along(pose, command, np.linspace(0, 0.5, 11))).all()
                require(is_free, f"commands {tuple(command)} with an obstacle {gap:g} m ahead")

    @promise
    def it_never_drives_into_a_wall_across_its_path(self) -> None:
        """Given a wall across the path then the robot never touches the wall."""
        view = self.view(*((4.0, float(y), 0.3) for y in np.arange(0.0, 6.1, 0.3)))
        controller, pose, twist = self.controller_on_path(), Pose2(1.0, 3.0, 0.0), Twist()
        footprint = Footprint(self.robot, 0.05)
        for _ in range(200):
            try:
                twist = self.command(controller, pose, twist, view)
            except NavigationFailure as failure:
                require_no_valid_control(failure)
                twist = Twist()
            pose = move(pose, twist)
            require(footprint.free(view, np.array([pose]))[0], f"drives into the wall at ({pose.x:.2f}, {pose.y:.2f})")

    @promise
    def the_same_calls_give_the_same_commands_bit_for_bit(self) -> None:
        """Given the same calls and seed then the commands are bit-identical."""
        view = self.view((4.0, 3.4, 0.15))
        one, other = (self.drive(self.controller_on_path(), view, Pose2(1, 3.15, 0.3), 2.0) for _ in range(2))
        require(one == other, "two drives with the same seed differ")

    @promise
    def an_empty_path_is_an_invalid_path(self) -> None:
        """Given a path without points then the controller fails with INVALID_PATH."""
        controller = self.build()
        try:
            call_component("receives an empty path", lambda: controller.set_path(Path()))
        except NavigationFailure as failure:
            require(failure.code == ErrorCode.INVALID_PATH, f"fails with {failure.code.name}, not with INVALID_PATH")
        else:
            require(False, "accepts a path without points")

    @promise
    def path_and_costmap_are_not_changed_and_the_costmap_is_not_kept(self) -> None:
        """Given path and costmap then both are not changed, and later changes of the costmap have no effect."""
        view, controller, path = self.view(), self.build(), Path(PATH_POINTS.copy())
        other, pose = self.controller_on_path(), Pose2(1, 3)
        controller.set_path(path)
        old, untouched = copy_costmap(view), copy_costmap(view)
        self.command(controller, pose, Twist(), old)
        require(np.array_equal(path.points, PATH_POINTS), "changes the path")
        require(are_equal_costmaps(old, untouched), "changes the costmap")
        overwrite_costmap(old)
        self.command(other, pose, Twist(), view)
        commands = [self.command(each, pose, Twist(), view) for each in (controller, other)]
        require(commands[0] == commands[1], "an old costmap affects a new command")

    @promise
    def its_local_plan_is_a_path_or_none(self) -> None:
        """Given a command then the local plan is a path of finite poses, or None."""
        controller = self.controller_on_path()
        self.command(controller, Pose2(1, 3), Twist(), self.view())
        plan = call_component("returns its local plan", lambda: controller.local_plan)
        is_valid = plan is None or (
            isinstance(plan, Path) and plan.points.shape[1:] == (3,) and np.isfinite(plan.points).all()
        )
        require(is_valid, "the local plan is not a path of finite poses (n, 3)")


def checked_command(command: Twist, robot: RobotModel) -> Twist:
    """Return the command. Raises PromiseBroken unless it is a finite Twist within the limits of the robot."""
    require(isinstance(command, Twist), f"commands {type(command).__name__}, not a Twist")
    require(all(map(math.isfinite, command)), f"commands {tuple(command)}")
    is_within_limits = (
        -robot.max_reverse - SPEED_TOLERANCE <= command.vx <= robot.max_linear + SPEED_TOLERANCE
        and abs(command.vy) <= robot.max_lateral + SPEED_TOLERANCE
        and abs(command.wz) <= robot.max_angular + SPEED_TOLERANCE
    )
    require(is_within_limits,
            f"commands {tuple(command)}, beyond the limits of the base: {robot.max_linear:g} m/s forward, "
            f"{robot.max_reverse:g} backward, {robot.max_lateral:g} sideways, {robot.max_angular:g} rad/s")  # fmt: skip
    return command


def is_at_goal(pose: Pose2) -> bool:
    """Return whether the pose is within GOAL_TOLERANCE of GOAL."""
    return pose.distance(GOAL.pose) < GOAL_TOLERANCE and abs(wrap(pose.yaw - GOAL.pose.yaw)) < GOAL_TOLERANCE


def move(pose: Pose2, twist: Twist) -> Pose2:
    """Return the pose after PERIOD_S at this velocity."""
    return Pose2(*arc_poses(pose, twist, [PERIOD_S])[0].tolist())


def require_no_valid_control(failure: NavigationFailure) -> None:
    """Raise PromiseBroken if the error code of the failure is not NO_VALID_CONTROL."""
    require(failure.code == ErrorCode.NO_VALID_CONTROL, f"fails with {failure.code.name}, not with NO_VALID_CONTROL")
