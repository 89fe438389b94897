"""Whether the robot gets anywhere: nav2_controller's Simple- and PoseProgressChecker."""

import math

from simscen.core.geometry import Pose2, wrap
from simscen.model.checkers import ProgressChecker as ProgressSpec


class ProgressChecker:
    """Wants `required_movement_radius` meters (or the angle, if given) within `movement_time_allowance`."""

    def __init__(self, spec: ProgressSpec) -> None:
        self._radius, self._angle = spec.required_movement_radius, spec.required_movement_angle
        self._allowance = spec.movement_time_allowance
        self._from: Pose2 | None = None
        self._since = 0.0

    def reset(self) -> None:
        """Count from the next pose on."""
        self._from = None

    def stuck(self, pose: Pose2, seconds: float) -> bool:
        """Whether the allowance is over; `seconds` is a clock that stands still while the robot may not move."""
        start = self._from
        if (
            start is None
            or math.hypot(pose.x - start.x, pose.y - start.y) >= self._radius
            or (self._angle is not None and abs(wrap(pose.yaw - start.yaw)) >= self._angle)
        ):
            self._from, self._since = pose, seconds
        return seconds - self._since > self._allowance
