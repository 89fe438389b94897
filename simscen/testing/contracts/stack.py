"""Contract of stacks: checks that every stack must pass."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Readings, Scan
from simscen.core.random_streams import Streams
from simscen.core.records.events import GOAL_END_KINDS, Event, EventKind
from simscen.core.records.trace import Decision
from simscen.stack.protocols import RobotModel, Stack, Surroundings
from simscen.stack.setting import Setting
from simscen.testing.contracts.base import Contract, call_component, promise, require
from simscen.testing.flatland import CONTROL_PERIOD_TICKS, TICK_RATE_HZ, Drive, Flatland, round_robot

START_POSE, NEAR_GOAL, FAR_GOAL = Pose2(1, 2), Goal("near", Pose2(1.8, 2.0, 0.0)), Goal("far", Pose2(5, 2, 0.0))
SIDE_GOAL = Goal("aside", Pose2(1.5, 3.2, 1.5))


def names_of_kind(drive: Drive, kind: str) -> list[str]:
    """Return the names of the events of this kind so far."""
    return [event.name for event in drive.events_of_kind(kind)]


class DecisionCheckingStack:
    """Wrapper of a stack that checks each decision: types, finite commands, and events of the current tick."""

    def __init__(self, stack: Stack) -> None:
        self.stack = stack

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Return the decision of the stack. Raises PromiseBroken for an invalid decision or a changed scan."""
        ranges = [reading.ranges.copy() for reading in readings if isinstance(reading, Scan)]
        decision = call_component("decides", lambda: self.stack.decide(tick, readings))
        require(isinstance(decision, Decision), f"returns {type(decision).__name__}, not a Decision")
        require(all(map(math.isfinite, decision.command)), f"commands {tuple(decision.command)}")
        scans = [reading for reading in readings if isinstance(reading, Scan)]
        is_unchanged = all(np.array_equal(a, b.ranges, equal_nan=True) for a, b in zip(ranges, scans, strict=True))
        require(is_unchanged, "changes the ranges of a scan")
        for event in decision.events:
            require(isinstance(event, Event) and isinstance(event.kind, EventKind), f"reports {event!r}, not an Event")
            require(event.tick == tick, f"reports at tick {tick} the event {event.kind} of tick {event.tick}")
        return decision

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stack, name)


@dataclass(frozen=True, eq=False)
class StackContract(Contract):
    """Contract of a stack in a room of 6 m by 4 m. `robot` is the driving robot; None for a round robot."""

    role = "stack"
    robot: RobotModel | None = None

    def new_drive(self, *goals: Goal, discs: tuple[tuple[float, float, float], ...] = ()) -> Drive:
        """Return a drive to the goals before the first step. `discs` are unmapped obstacles (x, y, radius) in m."""
        robot, world = self.robot or round_robot(), Flatland().room(6, 4)
        grid = world.grid((-0.5, -0.5, 6.5, 4.5))
        world.discs += discs
        surroundings = Surroundings(robot, grid, TICK_RATE_HZ, lidars=("lidar",))
        setting = Setting(
            surroundings,
            "stack",
            Streams(1),
            CONTROL_PERIOD_TICKS / TICK_RATE_HZ,
            estimate=Estimate(START_POSE, (0.05, 0.05, 0.02)),
        )
        stack = call_component("is built", lambda: self.spec.implementation()(self.spec, setting))
        call_component("starts", lambda: stack.start(setting.estimate, goals))
        odometry = ("odom", "ground_truth") if self.has_true_poses else ("odom",)
        return Drive(world, robot, DecisionCheckingStack(stack), START_POSE, odometry=odometry)

    @property
    def has_true_poses(self) -> bool:
        """Whether the localizer of the stack uses true poses."""
        return bool(getattr(getattr(self.spec, "localizer", None), "type", "") == "ground_truth")

    @promise
    def it_reaches_a_goal_around_an_unmapped_obstacle_without_contact(self) -> None:
        """Given an unmapped obstacle on the way to the goal then the robot reaches the goal without contact."""
        d = self.new_drive(FAR_GOAL, discs=((3.2, 1.9, 0.25),)).run(90)
        require(
            d.result == "SUCCEEDED", f"navigation ends with {d.result or 'nothing'} after {d.tick / TICK_RATE_HZ:.0f} s"
        )
        distance = d.pose.distance(FAR_GOAL.pose)
        require(distance <= FAR_GOAL.xy_tolerance, f"says that it has reached a goal that is {distance:.2f} m away")
        require(d.min_clearance > 0, f"the robot touches something: clearance {d.min_clearance:.3f} m")

    @promise
    def without_a_goal_it_commands_zero(self) -> None:
        """Given no goal then the command is zero, and there is no plan."""
        d = self.new_drive().run(0.5)
        require(set(d.commands) == {STOP}, "commands a velocity without a goal")
        require(d.stack.goal is None and d.stack.plan is None, "has a goal or a plan although it received none")

    @promise
    def once_a_task_has_ended_it_commands_zero(self) -> None:
        """Given a task that has ended then the command is zero from the step of its end on."""
        d = self.new_drive(NEAR_GOAL).run(30)
        require(
            d.result == "SUCCEEDED", f"navigation ends with {d.result or 'nothing'} after {d.tick / TICK_RATE_HZ:.0f} s"
        )
        end_index = len(d.commands) - 1
        d.run(0.5, until="")
        require(set(d.commands[end_index:]) == {STOP}, "commands a velocity after the end of its task")
        require(d.stack.goal is None, "has a goal after the end of its task")

    @promise
    def a_canceled_task_ends_at_once(self) -> None:
        """Given a canceled task then task and goal end as canceled, and the command is zero from the next step on."""
        d = self.new_drive(FAR_GOAL, NEAR_GOAL).run(2)
        call_component("is canceled", lambda: d.stack.cancel(d.tick))
        cancel_index = len(d.commands)
        d.run(0.5, until="")
        require(set(d.commands[cancel_index:]) == {STOP}, "commands a velocity after it was canceled")
        require(names_of_kind(d, "goal.canceled") == ["far"], "does not report that its goal is canceled")
        require(names_of_kind(d, "navigation.ended") == ["CANCELED"], "does not end its task as CANCELED")

    @promise
    def a_goal_that_preempts_is_driven_to_first(self) -> None:
        """Given a goal that preempts then the current goal is canceled, and the robot drives to the new goal."""
        d = self.new_drive(FAR_GOAL).run(1)
        call_component("is preempted", lambda: d.stack.preempt(d.tick, SIDE_GOAL))
        d.run(0.5, until="")
        require(d.stack.goal == SIDE_GOAL, f"drives to {d.stack.goal} after it was sent to {SIDE_GOAL}")
        d.run(60)
        canceled = names_of_kind(d, "goal.canceled")
        require(canceled == ["far"], f"reports that {canceled or 'nothing'} is canceled, not far")
        require(
            names_of_kind(d, "goal.reached") == ["aside"],
            "does not reach the goal that it was sent to",
        )

    @promise
    def every_goal_is_accepted_once_and_ends_once(self) -> None:
        """Given a reachable and an unreachable goal then each goal is accepted once and ends once, in this order."""
        d = self.new_drive(NEAR_GOAL, Goal("never", Pose2(40.0, 0.0), timeout=3.0)).run(60)
        accepted = names_of_kind(d, "goal.accepted")
        ended = [e.name for e in d.log if e.kind in GOAL_END_KINDS]
        require(accepted == ["near", "never"], f"accepts {accepted}, not near, then never")
        require(ended == ["near", "never"], f"ends {ended}, not near, then never")
        require(names_of_kind(d, "goal.failed") == ["never"], "does not fail a goal outside the map")
        require(
            names_of_kind(d, "navigation.ended") == ["FAILED"],
            "does not end its task once, as FAILED",
        )

    @promise
    def the_same_seed_gives_the_same_drive_bit_for_bit(self) -> None:
        """Given the same readings and seed then the commands and events are bit-identical."""
        one, other = (self.new_drive(FAR_GOAL, discs=((3.2, 1.9, 0.25),)).run(6) for _ in range(2))
        require(one.commands == other.commands, "two drives from the same seed differ in their commands")
        require(one.log == other.log, "two drives from the same seed differ in their events")

    @promise
    def invalid_scans_never_make_a_decision_invalid(self) -> None:
        """Given scans without any return, and then with ranges of nan, then all decisions are finite."""
        d = self.new_drive(FAR_GOAL)
        d.run(1, until="")
        d.range_max = -1.0  # no beam has a return
        d.run(1, until="")
        d.noise = math.nan
        d.run(1, until="")
