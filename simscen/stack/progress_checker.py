"""Whether the robot gets anywhere: nav2_controller's Simple- and PoseProgressChecker."""

from simscen.core.geometry import Pose2, wrap
from simscen.model.checkers import ProgressChecker as ProgressSpec


class ProgressChecker:
    """Wants `required_movement_radius` metres (or the angle, if given) within `movement_time_allowance`."""

    def __init__(self, spec: ProgressSpec) -> None:
        self._spec = spec
        self._from: Pose2 | None = None
        self._since = 0.0

    def reset(self) -> None:
        """Count from the next pose on."""
        self._from = None

    def stuck(self, pose: Pose2, seconds: float) -> bool:
        """Whether the allowance is over; `seconds` is a clock that stands still while the robot may not move."""
        if self._from is None or self._moved(self._from, pose):
            self._from, self._since = pose, seconds
        return seconds - self._since > self._spec.movement_time_allowance

    def _moved(self, before: Pose2, now: Pose2) -> bool:
        angle = self._spec.required_movement_angle
        turned = angle is not None and abs(wrap(now.yaw - before.yaw)) >= angle
        return turned or before.distance(now) >= self._spec.required_movement_radius
