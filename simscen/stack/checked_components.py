"""Wrappers that check the return values of planners, controllers, and other components of a stack."""

import math
import traceback
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, NoReturn, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt

from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, ErrorCode, Estimate, Path
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.controllers import GoalCheckerSpec
from simscen.model.localizers import LocalizerSpec
from simscen.model.planners import PlannerSpec
from simscen.model.recovery import BehaviorSpec
from simscen.model.stack_base import ControllerSpec
from simscen.spec.base import Component
from simscen.stack.protocols import (
    LETHAL,
    Behavior,
    Controller,
    CostmapView,
    GoalChecker,
    Localizer,
    NavigationFailure,
    Planner,
)
from simscen.stack.setting import Setting

P = ParamSpec("P")
T = TypeVar("T")
S = TypeVar("S", bound=Component)


def build_component(wrapper: Callable[[S, Setting], T], spec: S, setting: Setting) -> T:
    """Build a component from its specification. If it comes from another package, return it inside `wrapper`."""
    component: T = (spec.implementation() if spec.component.startswith("simscen.") else wrapper)(spec, setting)
    return component


class CheckedPlugin:
    """Base class of the wrappers. An invalid return value or an unexpected exception raises RunError.

    The parameter `prefix` of methods is the start of an error message, such as "returned".
    """

    may_fail: ClassVar[bool] = True
    """Whether a component of this role may raise NavigationFailure."""

    def __init__(self, role: str, spec: Component, setting: Setting, protocol: type) -> None:
        """Build the component. Raises RunError if it lacks a method of `protocol`. `role` is for example "planner"."""
        self.role, self._spec = role, spec
        self.inner: Any = self.call(lambda: spec.implementation()(spec, setting))
        for name in method_names(protocol):
            if not callable(getattr(self.inner, name, None)):
                self.raise_invalid(f"{type(self.inner).__name__} has no method `{name}`, which every {role} needs")

    @property
    def label(self) -> str:
        """Name in messages, e.g. "planner `theta_star` (theta_star.planner:ThetaStar)"."""
        kind = getattr(self._spec, "type", "")
        return f"{self.role} `{kind}` ({self._spec.component})" if kind else f"{self.role} ({self._spec.component})"

    def call(self, method: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a method of the component, and return its result. Exceptions go through `raise_as_run_error`."""
        try:
            return method(*args, **kwargs)
        except Exception as error:  # code of other packages can raise anything
            self.raise_as_run_error(error)

    def raise_as_run_error(self, error: Exception) -> NoReturn:
        """Raise a RunError that names the component.

        RunError, MemoryError, and, if `may_fail`, NavigationFailure are raised unchanged.
        """
        if isinstance(error, RunError | MemoryError):
            raise error
        if isinstance(error, NavigationFailure) and self.may_fail:
            if not isinstance(error.code, ErrorCode):
                self.raise_invalid(f"failed with {error.code!r}, which is not an ErrorCode")
            raise error
        message = f"{self.label}: {type(error).__name__}: {error} ({self._location(error)})"
        raise RunError("crashed", message, by_stack=True) from error

    def raise_invalid(self, problem: str) -> NoReturn:
        """Raise a RunError with the message "<label> <problem>"."""
        raise RunError(BROKEN_COMPONENT, f"{self.label} {problem}", by_stack=True)

    def checked_path(self, path: object, prefix: str) -> Path:
        """Return the path if it consists of finite poses (n, 3); otherwise raise RunError."""
        if not isinstance(path, Path):
            self.raise_invalid(f"{prefix} {type(path).__name__} instead of a Path")
        points = path.points
        if not isinstance(points, np.ndarray) or points.ndim != 2 or points.shape[1] != 3:
            self.raise_invalid(f"{prefix} a path whose points are {_shape_text(points)} instead of (n, 3): x, y, yaw")
        if points.dtype.kind != "f" or not all_finite(points):
            self.raise_invalid(f"{prefix} a path with points that are not finite numbers")
        return path

    def checked_twist(self, command: object) -> Twist:
        """Return the velocity if it consists of three finite numbers; otherwise raise RunError."""
        if not isinstance(command, Twist):
            self.raise_invalid(f"commanded {type(command).__name__} instead of a Twist")
        if not are_numbers(command):
            self.raise_invalid(f"commanded {tuple(command)}, which is not a finite velocity")
        return command

    def checked_pose(self, pose: object, prefix: str) -> Pose2:
        """Return the pose if it consists of three finite numbers; otherwise raise RunError."""
        if not isinstance(pose, Pose2) or not are_numbers(pose):
            self.raise_invalid(f"{prefix} {pose!r}, which is not a finite pose")
        return pose

    def _location(self, error: Exception) -> str:
        """Return "file:line" of the traceback: if possible, of the innermost entry in the component's package."""
        package = self._spec.component.partition(":")[0].partition(".")[0]
        frames = list(traceback.walk_tb(error.__traceback__))
        own = [entry for entry in frames if str(entry[0].f_globals.get("__name__", "")).partition(".")[0] == package]
        frame, line = (own or frames)[-1]
        return f"{frame.f_code.co_filename.rpartition('/')[2]}:{line}"


def method_names(protocol: type) -> list[str]:
    """Return the names of the public methods of a protocol."""
    return [name for name, value in vars(protocol).items() if callable(value) and not name.startswith("_")]


def are_numbers(values: Iterable[object]) -> bool:
    """Return whether all values are real numbers and finite."""
    try:
        return math.isfinite(math.hypot(*values))  # type: ignore[arg-type]  # other types raise
    except TypeError:
        return False


def all_finite(values: Array) -> bool:
    """Return whether all numbers of an array are finite."""
    return math.isfinite(np.vdot(values, values)) or bool(np.isfinite(values).all())  # the sum of squares is faster


def _shape_text(points: object) -> str:
    return str(points.shape) if isinstance(points, np.ndarray) else type(points).__name__


START_TOLERANCE_M = 0.05
"""Largest distance between the requested start and the first point of a path."""


class CheckedPlanner(CheckedPlugin):
    """Calls the planner and checks its path."""

    def __init__(self, spec: PlannerSpec, setting: Setting) -> None:
        super().__init__("planner", spec, setting, Planner)
        self._radius = setting.robot.circumscribed_radius

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return the planner's path. Raises RunError if it is invalid or leads through a lethal cell.

        Lethal cells within the circumscribed radius of the start are allowed, since the robot already stands there.
        """
        path = self.checked_path(self.call(self.inner.plan, costmap, start, goal, seed), "returned")
        points = path.points
        if not len(points):
            self.raise_invalid("returned a path without points instead of failing with NO_VALID_PATH")
        if np.hypot(points[0, 0] - start.x, points[0, 1] - start.y) > START_TOLERANCE_M:
            begin = _position_text(points[0])
            self.raise_invalid(f"returned a path from {begin} instead of the start {_position_text(np.array(start))}")
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
    """Calls the controller and checks its commands."""

    def __init__(self, spec: ControllerSpec, setting: Setting) -> None:
        super().__init__("controller", spec, setting, Controller)

    def set_path(self, path: Path) -> None:
        """Follow this path from now on."""
        self.call(self.inner.set_path, path)

    @property
    def full_speed(self) -> float:
        """Speed in m/s without a speed limit."""
        speed = self.call(lambda: self.inner.full_speed)
        if not isinstance(speed, float | int) or not math.isfinite(speed) or speed < 0:
            self.raise_invalid(f"returned {speed!r} as its full speed, which is not a finite number of at least 0")
        return float(speed)

    def set_speed_limit(self, limit: float | None) -> None:
        """Set the speed limit in m/s; None removes it."""
        self.call(self.inner.set_speed_limit, limit)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the controller's command. Raises RunError when it is invalid."""
        return self.checked_twist(self.call(self.inner.command, pose, twist, costmap, goal))

    @property
    def local_plan(self) -> Path | None:
        """Trajectory that the controller expects to drive; None if it has none."""
        plan = self.call(lambda: self.inner.local_plan)
        return None if plan is None else self.checked_path(plan, "returned as `local_plan`")


class CheckedGoalChecker(CheckedPlugin):
    """Calls the goal checker and checks that it returns a boolean."""

    may_fail = False

    def __init__(self, spec: GoalCheckerSpec, setting: Setting) -> None:
        super().__init__("goal_checker", spec, setting, GoalChecker)

    def reset(self) -> None:
        """Reset the goal checker for a new goal."""
        self.call(self.inner.reset)

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Return whether the goal is reached. Raises RunError if the result is not a boolean."""
        reached = self.call(self.inner.reached, goal, pose, twist)
        if reached not in (True, False):
            self.raise_invalid(f"returned {reached!r} instead of True or False")
        return bool(reached)


class CheckedBehavior(CheckedPlugin):
    """Calls the recovery behavior and checks its commands. `name` is the `type` in its specification, if any."""

    def __init__(self, spec: BehaviorSpec, setting: Setting) -> None:
        super().__init__("behavior", spec, setting, Behavior)
        self.name: str = spec.type or self.inner.name

    def start(self, pose: Pose2) -> None:
        """Start at this pose."""
        self.call(self.inner.start, pose)

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the behavior's command; None when it is done. Raises RunError when it is invalid."""
        command = self.call(self.inner.step, pose, costmap, seconds)
        return None if command is None else self.checked_twist(command)


class CheckedLocalizer(CheckedPlugin):
    """Passes readings to the localizer and checks each new belief."""

    may_fail = False

    def __init__(self, spec: LocalizerSpec, setting: Setting) -> None:
        super().__init__("localizer", spec, setting, Localizer)
        self._last: Belief | None = None

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
        """Belief of the localizer. Raises RunError when it is invalid."""
        try:
            belief = self.inner.belief
        except Exception as error:  # as in `call`, without its overhead at every beat
            self.raise_as_run_error(error)
        if self._last is None or belief is not self._last:
            self._last = checked_belief(self, belief, self._last)
        return self._last


def checked_belief(plugin: CheckedPlugin, belief: object, before: Belief | None = None) -> Belief:
    """Return the belief if it is finite and has the right shapes; otherwise raise RunError, which names the plugin.

    `before` is the previous valid belief: shared `map_from_odom` and read-only particles are not checked again.
    """
    if not isinstance(belief, Belief):
        plugin.raise_invalid(f"returned {type(belief).__name__} instead of a Belief")
    plugin.checked_pose(belief.pose, "returned a Belief with the pose")
    if before is None or belief.map_from_odom is not before.map_from_odom:
        plugin.checked_pose(belief.map_from_odom, "returned a Belief with `map_from_odom`")
    if not _is_finite_table(belief.covariance, 3) or len(belief.covariance) != 3:
        plugin.raise_invalid("returned a Belief whose covariance is not a finite array (3, 3)")
    is_checked = before is not None and belief.particles is before.particles and not belief.particles.flags.writeable
    if not is_checked and not _is_finite_table(belief.particles, 4):
        plugin.raise_invalid("returned a Belief whose particles are not a finite array (n, 4)")
    return belief


def _is_finite_table(value: object, columns: int) -> bool:
    return isinstance(value, np.ndarray) and value.shape[1:] == (columns,) and all_finite(value)
