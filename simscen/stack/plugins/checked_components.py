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
"""Meters between the start that was asked for and the first point of a path, at most."""


class CheckedPlanner(CheckedPlugin):
    """Asks the planner, and looks at its path before anybody follows it."""

    def __init__(self, spec: PlannerSpec, setting: Setting) -> None:
        super().__init__("planner", spec, setting, Planner)
        self._reach = setting.robot.circumscribed_radius

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """The planner's path. Raises RunError when it is none, or leads through an obstacle."""
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
    """Which of the points (n, …) lie on a lethal cell; those off the costmap do not."""
    cells = np.floor((points[:, :2] - costmap.origin) / costmap.resolution)[:, ::-1]
    inside: npt.NDArray[np.bool_] = np.all((cells >= 0) & (cells < costmap.costs.shape), axis=1)
    rows, columns = np.where(inside[:, None], cells, 0).astype(np.int64).T
    struck: npt.NDArray[np.bool_] = inside & (costmap.costs[rows, columns] == LETHAL)
    return struck


def _at(point: Array) -> str:
    return f"({point[0]:.2f}, {point[1]:.2f})"


class CheckedController(CheckedPlugin):
    """Asks the controller, and looks at its commands before anybody obeys them."""

    def __init__(self, spec: ControllerSpec, setting: Setting) -> None:
        super().__init__("controller", spec, setting, Controller)

    def set_path(self, path: Path) -> None:
        """Follow this path from now on."""
        self.ask(self.inner.set_path, path)

    @property
    def full_speed(self) -> float:
        """What it drives at in m/s where nothing limits it."""
        speed = self.ask(lambda: self.inner.full_speed)
        if not isinstance(speed, float | int) or not math.isfinite(speed) or speed < 0:
            self.broke(f"says that its full speed is {speed!r}")
        return float(speed)

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s from now on; None lifts the limit."""
        self.ask(self.inner.set_speed_limit, limit)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """The controller's command. Raises RunError when it is none."""
        return self.checked_twist(self.ask(self.inner.command, pose, twist, costmap, goal))

    @property
    def local_plan(self) -> Path | None:
        """The arc it expects to drive, for the log."""
        plan = self.ask(lambda: self.inner.local_plan)
        return None if plan is None else self.checked_path(plan, "expects to drive")


class CheckedGoalChecker(CheckedPlugin):
    """Asks the goal checker, and takes nothing but yes or no for an answer."""

    may_fail = False

    def __init__(self, spec: GoalCheckerSpec, setting: Setting) -> None:
        super().__init__("goal_checker", spec, setting, GoalChecker)

    def reset(self) -> None:
        """A new goal."""
        self.ask(self.inner.reset)

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Whether the goal is reached. Raises RunError when the answer is neither yes nor no."""
        reached = self.ask(self.inner.reached, goal, pose, twist)
        if reached not in (True, False):
            self.broke(f"answered {reached!r} to whether a goal is reached")
        return bool(reached)


class CheckedBehavior(CheckedPlugin):
    """Asks the behavior, and looks at its commands before anybody obeys them. Its name is that of its type."""

    def __init__(self, spec: BehaviorSpec, setting: Setting) -> None:
        super().__init__("behavior", spec, setting, Behavior)
        self.name: str = spec.type or self.inner.name

    def start(self, pose: Pose2) -> None:
        """Begin from this pose."""
        self.ask(self.inner.start, pose)

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """The behavior's command; None when it is done. Raises RunError when it is none of them."""
        command = self.ask(self.inner.step, pose, costmap, seconds)
        return None if command is None else self.checked_twist(command)


class CheckedLocalizer(CheckedPlugin):
    """Hands readings on, and looks at each new belief before anybody trusts it."""

    may_fail = False

    def __init__(self, spec: LocalizerSpec, setting: Setting) -> None:
        super().__init__("localizer", spec, setting, Localizer)
        self._seen: Belief | None = None

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate."""
        self.ask(self.inner.reset, estimate)

    def on_odometry(self, odometry: Odometry) -> None:
        """Take a step of dead reckoning."""
        self.ask(self.inner.on_odometry, odometry)

    def on_scan(self, scan: Scan) -> None:
        """Correct with a lidar scan."""
        self.ask(self.inner.on_scan, scan)

    def on_imu(self, imu: Imu) -> None:
        """Take a turn rate."""
        self.ask(self.inner.on_imu, imu)

    @property
    def belief(self) -> Belief:
        """The localizer's belief. Raises RunError when it is none."""
        try:
            belief = self.inner.belief
        except Exception as error:  # as in `ask`, and it is asked at every beat
            self.raised(error)
        if self._seen is None or belief is not self._seen:
            self._seen = checked_belief(self, belief, self._seen)
        return self._seen


def checked_belief(watched: CheckedPlugin, belief: object, before: Belief | None = None) -> Belief:
    """A belief of finite numbers in the right shapes; what it has of the one `before` is not looked at again."""
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
