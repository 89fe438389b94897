"""Base class of the controllers: the path, the progress on it, and the speed limit."""

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.stack.controllers.path_handler import PathTracker
from simscen.stack.protocols import NavigationFailure, RobotModel

DEFAULT_SPEED_M_S = 0.5
"""m/s: Nav2's desired_linear_vel, and vx_max of MPPI."""
SAME_GOAL_M = 0.1
"""Meters by which corrections of the localizer may move the end of the path that is being followed."""


class PathFollower:
    """Follows a path at a speed that can be limited; a controller says how, in `command`."""

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
        """Forget what held for the way to another end; a new path to the same one may be the rest of the old."""

    @property
    def full_speed(self) -> float:
        """What it drives at in m/s where nothing limits it."""
        return self._fastest

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s; None lifts the limit."""
        self._limit = limit

    @property
    def _speed(self) -> float:
        """The greatest speed now in m/s."""
        return self._fastest if self._limit is None else min(self._fastest, self._limit)

    @property
    def _share(self) -> float:
        """Of all its velocities under the limit: Nav2's DWB and MPPI scale sideways and turning, too."""
        return self._speed / self._fastest

    def _located(self, pose: Pose2) -> PathTracker:
        """The path, and where the robot is on it."""
        if self._track is None:
            raise NavigationFailure(ErrorCode.INVALID_PATH, "there is no path to follow")
        self._track.locate(pose)
        return self._track
