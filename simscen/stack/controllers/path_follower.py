"""Base class of the controllers: the path, the position of the robot on it, and the speed limit."""

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.stack_base import PathFollowerSpec
from simscen.stack.controllers.path_handler import PathTracker
from simscen.stack.protocols import NavigationFailure, RobotModel

DEFAULT_SPEED_M_S = 0.5
"""Nav2's default of desired_linear_vel and of MPPI's vx_max."""
MAX_SAME_GOAL_DISTANCE_M = 0.1
"""Two successive paths lead to the same goal if the distance between their ends is at most this value."""


class PathFollower:
    """Base class of a controller that follows a path at a limited speed. Subclasses implement `command`."""

    def __init__(self, spec: PathFollowerSpec, max_speed: float | None, robot: RobotModel) -> None:
        """Take the parameters, the maximum speed in m/s (None: Nav2's default), and the robot."""
        self._search_distance = spec.max_robot_pose_search_dist
        self._full_speed = min(max_speed or DEFAULT_SPEED_M_S, robot.max_linear)
        self._speed_limit: float | None = None
        self._tracker: PathTracker | None = None
        self._end: Pose2 | None = None

    def set_path(self, path: Path) -> None:
        """Follow this path from now on. Raises NavigationFailure with INVALID_PATH if it has no points."""
        if not len(path.points):
            raise NavigationFailure(ErrorCode.INVALID_PATH, "the path has no points")
        end = Pose2(*path.points[-1].tolist())
        if self._end is None or end.distance(self._end) > MAX_SAME_GOAL_DISTANCE_M:
            self.reset_for_goal()
        self._end, self._tracker = end, PathTracker(path, self._search_distance)

    def reset_for_goal(self) -> None:
        """Reset the state of the controller for another goal."""

    @property
    def full_speed(self) -> float:
        """Maximum speed in m/s while no speed limit is set."""
        return self._full_speed

    def set_speed_limit(self, limit: float | None) -> None:
        """Set the speed limit in m/s; None removes the limit."""
        self._speed_limit = limit

    @property
    def _speed(self) -> float:
        """Maximum speed in m/s with the current speed limit."""
        return self._full_speed if self._speed_limit is None else min(self._full_speed, self._speed_limit)

    @property
    def _speed_ratio(self) -> float:
        """Factor (0 … 1) by which the speed limit scales all velocities, as in Nav2's DWB and MPPI."""
        return self._speed / self._full_speed

    def _locate(self, pose: Pose2) -> PathTracker:
        """Return the path tracker, updated to the pose. Raises NavigationFailure (INVALID_PATH) if there is no path."""
        if self._tracker is None:
            raise NavigationFailure(ErrorCode.INVALID_PATH, "there is no path to follow")
        self._tracker.locate(pose)
        return self._tracker
