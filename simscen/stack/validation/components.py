"""Wrappers that check the return values of planners, controllers, and other components of a stack."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, Estimate, Path
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.controllers import GoalCheckerSpec
from simscen.model.localizers import LocalizerSpec
from simscen.model.planners import PlannerSpec
from simscen.model.recovery import BehaviorSpec
from simscen.model.stack_base import ControllerSpec
from simscen.spec.base import Component
from simscen.stack.protocols import LETHAL, Behavior, Controller, CostmapView, GoalChecker, Localizer, Planner
from simscen.stack.setting import Setting
from simscen.stack.validation.plugin import CheckedPlugin, are_numbers

T = TypeVar("T")
S = TypeVar("S", bound=Component)


def build_component(wrapper: Callable[[S, Setting], T], spec: S, setting: Setting) -> T:
    """Build a component from its specification. Components of other packages are wrapped in `wrapper`."""
    component: T = (spec.implementation() if spec.component.startswith("simscen.") else wrapper)(spec, setting)
    return component


START_TOLERANCE_M = 0.05
"""Maximum distance between the requested start and the first point of a path."""


class CheckedPlanner(CheckedPlugin):
    """Wrapper of a planner that validates the paths."""

    def __init__(self, spec: PlannerSpec, setting: Setting) -> None:
        super().__init__("planner", spec, setting, Planner)
        self._radius = setting.robot.circumscribed_radius

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return the planner's path. Raises RunError if the path is invalid or has a pose on a lethal cell.

        Lethal cells within the circumscribed radius of the start are allowed, because the robot already stands there.
        """
        path = self.checked_path(self.call(self.inner.plan, costmap, start, goal, seed), "returned")
        points = path.points
        if not len(points):
            self.raise_invalid("returned a path without points instead of failing with NO_VALID_PATH")
        if np.hypot(points[0, 0] - start.x, points[0, 1] - start.y) > START_TOLERANCE_M:
            first = _position_text(points[0])
            self.raise_invalid(f"returned a path from {first} instead of the start {_position_text(np.array(start))}")
        outside = points[np.hypot(points[:, 0] - start.x, points[:, 1] - start.y) > self._radius]
        if len(outside) and (is_lethal := on_lethal_cells(costmap, outside)).any():
            position = _position_text(outside[is_lethal.argmax()])
            self.raise_invalid(f"returned a path through the lethal cell at {position}")
        return path


def on_lethal_cells(costmap: CostmapView, points: Array) -> npt.NDArray[np.bool_]:
    """Return which of the points (n, 2) or (n, 3) are on a lethal cell; False outside the costmap."""
    cells = np.floor((points[:, :2] - costmap.origin) / costmap.resolution)[:, ::-1]
    inside: npt.NDArray[np.bool_] = np.all((cells >= 0) & (cells < costmap.costs.shape), axis=1)
    rows, columns = np.where(inside[:, None], cells, 0).astype(np.int64).T
    is_lethal: npt.NDArray[np.bool_] = inside & (costmap.costs[rows, columns] == LETHAL)
    return is_lethal


def _position_text(point: Array) -> str:
    return f"({point[0]:.2f}, {point[1]:.2f})"


class CheckedController(CheckedPlugin):
    """Wrapper of a controller that validates the commands."""

    def __init__(self, spec: ControllerSpec, setting: Setting) -> None:
        super().__init__("controller", spec, setting, Controller)

    def set_path(self, path: Path) -> None:
        """Follow this path from now on."""
        self.call(self.inner.set_path, path)

    @property
    def full_speed(self) -> float:
        """Maximum speed in m/s while no speed limit is set."""
        speed = self.call(lambda: self.inner.full_speed)
        if not are_numbers((speed,)) or speed < 0:
            self.raise_invalid(f"returned {speed!r} as its full speed, which is not a finite number of at least 0")
        return float(speed)

    def set_speed_limit(self, limit: float | None) -> None:
        """Set the speed limit in m/s; None removes the limit."""
        self.call(self.inner.set_speed_limit, limit)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the controller's command. Raises RunError if the command is invalid."""
        return self.checked_twist(self.call(self.inner.command, pose, twist, costmap, goal))

    @property
    def local_plan(self) -> Path | None:
        """Trajectory that the controller expects to drive; None if there is none."""
        plan = self.call(lambda: self.inner.local_plan)
        return None if plan is None else self.checked_path(plan, "returned as `local_plan`")


class CheckedGoalChecker(CheckedPlugin):
    """Wrapper of a goal checker that validates that the result is a boolean."""

    may_fail = False

    def __init__(self, spec: GoalCheckerSpec, setting: Setting) -> None:
        super().__init__("goal_checker", spec, setting, GoalChecker)

    def reset(self) -> None:
        """Reset the goal checker for a new goal."""
        self.call(self.inner.reset)

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Return whether the goal is reached. Raises RunError if the result is not a boolean."""
        reached = self.call(self.inner.reached, goal, pose, twist)
        if not isinstance(reached, bool | np.bool_):
            self.raise_invalid(f"returned {reached!r} instead of True or False")
        return bool(reached)


class CheckedBehavior(CheckedPlugin):
    """Wrapper of a recovery behavior that validates the commands.

    `name` is the `type` in the specification, or the behavior's own name if the specification has no `type`.
    """

    def __init__(self, spec: BehaviorSpec, setting: Setting) -> None:
        super().__init__("behavior", spec, setting, Behavior)
        self.name: str = spec.type or self.inner.name

    def start(self, pose: Pose2) -> None:
        """Start at this pose."""
        self.call(self.inner.start, pose)

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the behavior's command; None when the behavior is done. Raises RunError if the command is invalid."""
        command = self.call(self.inner.step, pose, costmap, seconds)
        return None if command is None else self.checked_twist(command)


class CheckedLocalizer(CheckedPlugin):
    """Wrapper of a localizer that validates the belief."""

    may_fail = False

    def __init__(self, spec: LocalizerSpec, setting: Setting) -> None:
        super().__init__("localizer", spec, setting, Localizer)
        self._last_belief: Belief | None = None

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate."""
        self.call(self.inner.reset, estimate)

    def on_odometry(self, odometry: Odometry) -> None:
        """Pass an odometry reading."""
        self.call(self.inner.on_odometry, odometry)

    def on_scan(self, scan: Scan) -> None:
        """Pass a lidar scan."""
        self.call(self.inner.on_scan, scan)

    def on_imu(self, imu: Imu) -> None:
        """Pass an IMU reading."""
        self.call(self.inner.on_imu, imu)

    @property
    def belief(self) -> Belief:
        """Belief of the localizer. Raises RunError if the belief is invalid."""
        try:
            belief = self.inner.belief
        except Exception as error:  # as in `call`, without its overhead in every control period
            self.raise_as_run_error(error)
        self._last_belief = self.checked_belief(belief, self._last_belief)
        return self._last_belief
