"""The advanced stack and its builder: the reference stack with motion prediction and compensation of slip and tilt."""

import math
from typing import Any

from simscen.advanced.prediction.motion_prediction import MotionPrediction
from simscen.advanced.replanning import AdvancedPlanManager
from simscen.advanced.tilt import TiltEstimator
from simscen.advanced.turn_slip import TurnSlipObserver
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.stack.build import StackBuilder
from simscen.stack.frames import Frames
from simscen.stack.navigator import ClearingPolicy
from simscen.stack.reference import ReferenceStack

ROBOT_IN_BASE_FRAME = Pose2(0.0, 0.0)
"""Pose of the robot in its own base frame."""


class AdvancedStack(ReferenceStack):
    """Reference stack that predicts moving obstacles and avoids them, also while the robot has no goal.

    The stack also ignores lidar hits on the floor while the robot is tilted, and compensates turn slip. The private
    methods are hooks that ReferenceStack calls.
    """

    def __init__(
        self,
        *parts: Any,
        prediction: MotionPrediction,
        tilt: TiltEstimator,
        turn_slip: TurnSlipObserver | None,
        **options: Any,
    ) -> None:
        """Take the arguments of ReferenceStack and three components. If `turn_slip` is None, turn slip is ignored."""
        super().__init__(*parts, **options)
        self._prediction, self._tilt, self._turn_slip = prediction, tilt, turn_slip
        self._has_moving_obstacles = False

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all following goals, and stay in place."""
        super().cancel(tick)
        self._prediction.hold()

    @property
    def components(self) -> tuple[tuple[str, Any, tuple[str, ...]], ...]:
        """The components of ReferenceStack, and the motion prediction."""
        return (*super().components, ("prediction", self._prediction, ("on_scan", "steer", "stand")))

    def _on_motion(self, reading: Odometry | Imu) -> None:
        self._prediction.add_reading(reading)
        if isinstance(reading, Imu):
            self._tilt.add_imu(reading)
        else:
            self._tilt.add_odometry(reading)

    def _on_odometry_step(self, wheels: Pose2, fused: Pose2) -> None:
        if self._turn_slip is not None:
            self._turn_slip.update(wheels, fused)

    def _on_lidar_scan(self, tick: int, scan: Scan) -> Scan:
        scan = self._tilt.without_floor(scan)
        self._prediction.on_scan(scan)
        return self._prediction.with_moving_hits(scan)

    def _on_costmaps_updated(self, tick: int, frames: Frames) -> None:
        """Pass the moving obstacles to the collision monitor (base frame) and to both costmaps (odom and map frame)."""
        if self._prediction.is_idle and not self._has_moving_obstacles:
            return
        moving = self._prediction.moving_obstacles_in_frame(tick, ROBOT_IN_BASE_FRAME)
        self._has_moving_obstacles = len(moving) > 0
        self._monitor.set_moving_obstacles(moving)
        self._costmaps.local_costmap.moving = self._prediction.moving_obstacles_in_frame(tick, frames.odometry)
        self._costmaps.global_costmap.moving = self._prediction.moving_obstacles_in_frame(tick, frames.pose)

    def _on_drive(self) -> None:
        self._prediction.on_drive()

    def _adjust_controller_command(self, tick: int, frames: Frames, command: Twist) -> Twist:
        if self._prediction.is_idle:
            return command
        costmap, limit = self._costmaps.global_costmap.view, self._max_speed(frames.pose)
        return self._prediction.steer(tick, command, frames.pose, self._twist, costmap, self.plan, limit)

    def _max_speed(self, pose: Pose2) -> float:
        """Return the limit in m/s of speed zones and masks at a pose; inf without a limit."""
        limit = self._speed_filter.limit(pose, self._controller.full_speed) if self._speed_filter.is_used else None
        return math.inf if limit is None else limit

    def _adjust_sent_command(self, command: Twist) -> Twist:
        return command if self._turn_slip is None else self._turn_slip.compensate(command)

    def _on_idle(self, tick: int, pose: Pose2) -> None:
        """Let the standing robot step aside for moving obstacles, and drive back to the old position afterward."""
        costmap = self._costmaps.global_costmap.view
        command = self._prediction.stand(tick, pose, self._twist, costmap, self._max_speed(pose))
        if command == STOP or self._monitor.is_silent(tick):
            self._commands.stop(tick)
        elif not self._commands.is_busy(tick):
            self._commands.request(tick, command, self._commands.elapsed_periods(tick))


FIRST_CLEARING_WAIT_S = 10.0
"""Minimum time between the first two clearings of the entire costmap; doubled after each clearing."""
CLEARING_PROGRESS_M = 1.0
"""Decrease of the distance to the goal that resets the time between two clearings to FIRST_CLEARING_WAIT_S."""


class ClearingBackoff(ClearingPolicy):
    """Policy that clears the entire global costmap at increasing intervals, and otherwise only around the robot."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Prepare for a new goal."""
        self._wait = FIRST_CLEARING_WAIT_S
        """Minimum time in s from the next clearing of the entire costmap to the following one."""
        self._due = 0.0
        """Time in s from which on the entire costmap may be cleared."""
        self._nearest = math.inf
        """Smallest distance in m to the goal at a clearing of the entire costmap."""

    def clears_entirely(self, now: float, goal_distance: float) -> bool:
        """Return whether to clear the entire costmap (see ClearingPolicy). Call this method once per clearing."""
        if goal_distance <= self._nearest - CLEARING_PROGRESS_M:
            self._wait, self._due = FIRST_CLEARING_WAIT_S, now
        if now < self._due:
            return False
        self._due, self._wait = now + self._wait, 2 * self._wait
        self._nearest = min(self._nearest, goal_distance)
        return True


class AdvancedStackBuilder(StackBuilder):
    """Builder of the advanced stack, with its own plan manager and clearing policy."""

    plan_manager = AdvancedPlanManager

    def make_clearing_policy(self) -> ClearingPolicy:
        """Make the policy for clearing the global costmap: always entirely if `recovery.clear_entirely`."""
        return ClearingPolicy() if self.spec.recovery.clear_entirely else ClearingBackoff()

    def make_stack(self, *parts: Any) -> AdvancedStack:
        """Make the stack from `parts`, the components of the reference stack."""
        surroundings, spec = self.surroundings, self.spec
        prediction = MotionPrediction(
            spec.prediction, self.robot, surroundings.lidars, surroundings.tick_rate, self.full_speed
        )
        compensates_slip = spec.localizer.fuses_odometry and spec.velocity_smoother.counter_turn_slip
        return AdvancedStack(
            *parts,
            prediction=prediction,
            tilt=TiltEstimator(surroundings.tick_rate),
            turn_slip=TurnSlipObserver() if compensates_slip else None,
        )
