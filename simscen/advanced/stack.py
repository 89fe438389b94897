"""The advanced stack: the reference stack with motion prediction and compensation of wheel slip."""

from typing import Any

from simscen.advanced.prediction.motion_prediction import MotionPrediction
from simscen.advanced.turn_slip import TurnSlipObserver
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.stack.frames import Frames
from simscen.stack.reference import ReferenceStack

ROBOT_FRAME = Pose2(0.0, 0.0)
"""Pose of the robot in its own frame."""


class AdvancedStack(ReferenceStack):
    """Reference stack that predicts and avoids moving obstacles, also while it stands."""

    def __init__(
        self, *parts: Any, prediction: MotionPrediction, turn_slip: TurnSlipObserver | None, **options: Any
    ) -> None:
        """Take the arguments of ReferenceStack, and the additional components."""
        super().__init__(*parts, **options)
        self._prediction, self._turn_slip = prediction, turn_slip
        self._has_moving_obstacles = False

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all after it, and stay in place."""
        super().cancel(tick)
        self._prediction.hold()

    @property
    def components(self) -> tuple[tuple[str, Any, tuple[str, ...]], ...]:
        """The components to measure in benchmarks: name, object, and the methods that take time."""
        return (*super().components, ("prediction", self._prediction, ("on_scan", "steer", "stand")))

    def _on_motion(self, reading: Odometry | Imu) -> None:
        self._prediction.take(reading)

    def _on_odometry_step(self, wheels: Pose2, fused: Pose2) -> None:
        if self._turn_slip is not None:
            self._turn_slip.learn(wheels, fused)

    def _on_lidar_scan(self, tick: int, scan: Scan) -> Scan:
        self._prediction.on_scan(scan)
        return self._prediction.marking(scan)

    def _on_costmaps_updated(self, tick: int, frames: Frames) -> None:
        """Give the moving obstacles to collision monitor, controller, and planner, each in its frame."""
        if self._prediction.calm and not self._has_moving_obstacles:
            return
        around = self._prediction.seen_from(tick, ROBOT_FRAME)
        self._has_moving_obstacles = len(around) > 0
        self._monitor.on_moving(around)
        self._costmaps.near.moving = self._prediction.seen_from(tick, frames.odometry)
        self._costmaps.wide.moving = self._prediction.seen_from(tick, frames.pose)

    def _on_drive(self) -> None:
        if self._prediction.stands:
            self._prediction.settle()

    def _adjust_wanted_command(self, tick: int, frames: Frames, command: Twist) -> Twist:
        if self._prediction.calm:
            return command
        return self._prediction.steer(tick, command, frames.pose, self._twist, self._costmaps.wide.view, self.plan)

    def _adjust_sent_command(self, command: Twist) -> Twist:
        return command if self._turn_slip is None else self._turn_slip.countered(command)

    def _on_idle(self, tick: int, pose: Pose2) -> None:
        """Step out of the way of moving obstacles, and come back."""
        command = self._prediction.stand(tick, pose, self._twist, self._costmaps.wide.view)
        if command == STOP or self._monitor.silent(tick):
            self._commands.stop(tick)
        elif not self._commands.busy(tick):
            self._commands.want(tick, command, self._commands.periods(tick))
