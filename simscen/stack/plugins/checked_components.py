"""Wrappers that check the answers of installed planners, controllers, goal checkers, behaviors and localizers."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Estimate, Goal, Path
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.checkers import GoalCheckerSpec
from simscen.model.localizers import LocalizerSpec
from simscen.model.planners import PlannerSpec
from simscen.model.recovery import BehaviorSpec
from simscen.model.stack_base import ControllerSpec
from simscen.stack.plugins.checked_plugin import CheckedPlugin, all_finite
from simscen.stack.protocols import LETHAL, Behavior, Controller, CostmapView, GoalChecker, Localizer, Planner
from simscen.stack.setting import Setting

START_TOLERANCE_M = 0.05
"""Largest distance between the requested start and the first point of a path."""


class CheckedPlanner(CheckedPlugin):
    """Calls the planner and checks its path."""

    def __init__(self, spec: PlannerSpec, setting: Setting) -> None:
        super().__init__("planner", spec, setting, Planner)
        self._reach = setting.robot.circumscribed_radius

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return the planner's path. Raises RunError when it is invalid or leads through an obstacle."""
        path = self.checked_path(self.ask(self.inner.plan, costmap, start, goal, seed), "returned")
        points = path.points
        if not len(points):
            self.broke("returned a path without points instead of failing with NO_VALID_PATH")
        if np.hypot(points[0, 0] - start.x, points[0, 1] - start.y) > START_TOLERANCE_M:
            self.broke(f"returned a path that begins at {_at(points[0])}, not at the start {_at(np.array(start))}")
        away = points[np.hypot(points[:, 0] - start.x, points[:, 1] - start.y) > self._reach]
        if len(away) and (struck := lethal(costmap, away)).any():
            self.broke(f"returned a path through an obstacle: the cell at {_at(away[struck.argmax()])} is lethal")
        return path


def lethal(costmap: CostmapView, points: Array) -> npt.NDArray[np.bool_]:
    """Return which of the points (n, …) lie on a lethal cell; points off the costmap do not."""
    cells = np.floor((points[:, :2] - costmap.origin) / costmap.resolution)[:, ::-1]
    inside: npt.NDArray[np.bool_] = np.all((cells >= 0) & (cells < costmap.costs.shape), axis=1)
    rows, columns = np.where(inside[:, None], cells, 0).astype(np.int64).T
    struck: npt.NDArray[np.bool_] = inside & (costmap.costs[rows, columns] == LETHAL)
    return struck


def _at(point: Array) -> str:
    return f"({point[0]:.2f}, {point[1]:.2f})"


class CheckedController(CheckedPlugin):
    """Calls the controller and checks its commands."""

    def __init__(self, spec: ControllerSpec, setting: Setting) -> None:
        super().__init__("controller", spec, setting, Controller)

    def set_path(self, path: Path) -> None:
        """Follow this path from now on."""
        self.ask(self.inner.set_path, path)

    @property
    def full_speed(self) -> float:
        """Speed in m/s without a speed limit."""
        speed = self.ask(lambda: self.inner.full_speed)
        if not isinstance(speed, float | int) or not math.isfinite(speed) or speed < 0:
            self.broke(f"says that its full speed is {speed!r}")
        return float(speed)

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s from now on; None lifts the limit."""
        self.ask(self.inner.set_speed_limit, limit)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the controller's command. Raises RunError when it is invalid."""
        return self.checked_twist(self.ask(self.inner.command, pose, twist, costmap, goal))

    @property
    def local_plan(self) -> Path | None:
        """Trajectory that the controller expects to drive, for the log."""
        plan = self.ask(lambda: self.inner.local_plan)
        return None if plan is None else self.checked_path(plan, "expects to drive")


class CheckedGoalChecker(CheckedPlugin):
    """Calls the goal checker and accepts only a boolean answer."""

    may_fail = False

    def __init__(self, spec: GoalCheckerSpec, setting: Setting) -> None:
        super().__init__("goal_checker", spec, setting, GoalChecker)

    def reset(self) -> None:
        """Reset the goal checker for a new goal."""
        self.ask(self.inner.reset)

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Return whether the goal is reached. Raises RunError when the answer is not a boolean."""
        reached = self.ask(self.inner.reached, goal, pose, twist)
        if reached not in (True, False):
            self.broke(f"answered {reached!r} to whether a goal is reached")
        return bool(reached)


class CheckedBehavior(CheckedPlugin):
    """Calls the behavior and checks its commands. Its name is that of its type."""

    def __init__(self, spec: BehaviorSpec, setting: Setting) -> None:
        super().__init__("behavior", spec, setting, Behavior)
        self.name: str = spec.type or self.inner.name

    def start(self, pose: Pose2) -> None:
        """Begin from this pose."""
        self.ask(self.inner.start, pose)

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the behavior's command; None when it is done. Raises RunError when it is invalid."""
        command = self.ask(self.inner.step, pose, costmap, seconds)
        return None if command is None else self.checked_twist(command)


class CheckedLocalizer(CheckedPlugin):
    """Passes readings to the localizer and checks each new belief."""

    may_fail = False

    def __init__(self, spec: LocalizerSpec, setting: Setting) -> None:
        super().__init__("localizer", spec, setting, Localizer)
        self._seen: Belief | None = None

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate."""
        self.ask(self.inner.reset, estimate)

    def on_odometry(self, odometry: Odometry) -> None:
        """Pass an odometry reading."""
        self.ask(self.inner.on_odometry, odometry)

    def on_scan(self, scan: Scan) -> None:
        """Pass a lidar scan."""
        self.ask(self.inner.on_scan, scan)

    def on_imu(self, imu: Imu) -> None:
        """Pass an IMU reading."""
        self.ask(self.inner.on_imu, imu)

    @property
    def belief(self) -> Belief:
        """Belief of the localizer. Raises RunError when it is invalid."""
        try:
            belief = self.inner.belief
        except Exception as error:  # as in `ask`, and it is asked at every beat
            self.raised(error)
        if self._seen is None or belief is not self._seen:
            self._seen = checked_belief(self, belief, self._seen)
        return self._seen


def checked_belief(watched: CheckedPlugin, belief: object, before: Belief | None = None) -> Belief:
    """Return the belief if it is finite and well shaped. Parts shared with `before` are not checked again."""
    if not isinstance(belief, Belief):
        watched.broke(f"believes {type(belief).__name__} instead of a Belief")
    watched.checked_pose(belief.pose, "believes to be at")
    if before is None or belief.map_from_odom is not before.map_from_odom:
        watched.checked_pose(belief.map_from_odom, "puts the odom frame at")
    if not _is_table(belief.covariance, 3) or len(belief.covariance) != 3:
        watched.broke("believes with a covariance that is no finite array (3, 3)")
    known = before is not None and belief.particles is before.particles and not belief.particles.flags.writeable
    if not known and not _is_table(belief.particles, 4):
        watched.broke("believes with particles that are no finite array (n, 4)")
    return belief


def _is_table(value: object, columns: int) -> bool:
    return isinstance(value, np.ndarray) and value.shape[1:] == (columns,) and all_finite(value)
