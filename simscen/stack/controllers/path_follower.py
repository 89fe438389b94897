"""Base class of the controllers: the path, the progress on it, and the speed limit."""

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.controllers.path_handler import PathTracker
from simscen.stack.protocols import NavigationFailure, RobotModel

DEFAULT_SPEED_M_S = 0.5
"""Nav2's default of desired_linear_vel and of MPPI's vx_max."""
SAME_GOAL_M = 0.1
"""Distance by which a localization correction may move the goal without a reset of the controller."""


class PathFollower:
    """Base class of a controller that follows a path at a limited speed. Subclasses implement `command`."""

    def __init__(self, wanted: float | None, robot: RobotModel) -> None:
        self._fastest = min(wanted or DEFAULT_SPEED_M_S, robot.max_linear)
        self._limit: float | None = None
        self._track: PathTracker | None = None
        self._end: Pose2 | None = None

    def set_path(self, path: Path) -> None:
        """Follow this path from now on."""
        if not len(path.points):
            raise NavigationFailure(ErrorCode.INVALID_PATH, "the path has no points")
        end = Pose2(*path.points[-1].tolist())
        if self._end is None or end.distance(self._end) > SAME_GOAL_M:
            self.begin()
        self._end, self._track = end, PathTracker(path)

    def begin(self) -> None:
        """Reset the state for a path to another goal. A new path to the same goal does not reset it."""

    @property
    def full_speed(self) -> float:
        """Speed in m/s without a speed limit."""
        return self._fastest

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s; None lifts the limit."""
        self._limit = limit

    @property
    def _speed(self) -> float:
        """Maximum speed now, in m/s."""
        return self._fastest if self._limit is None else min(self._fastest, self._limit)

    @property
    def _share(self) -> float:
        """Ratio by which the speed limit scales all velocities, as in Nav2's DWB and MPPI."""
        return self._speed / self._fastest

    def _located(self, pose: Pose2) -> PathTracker:
        """Return the path, updated with the position of the robot on it."""
        if self._track is None:
            raise NavigationFailure(ErrorCode.INVALID_PATH, "there is no path to follow")
        self._track.locate(pose)
        return self._track
