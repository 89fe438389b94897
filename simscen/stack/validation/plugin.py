"""Base class of wrappers that call a stack or a component of a stack, and validate the results."""

import math
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, NoReturn, ParamSpec, TypeVar

import numpy as np

from simscen.core.errors import BROKEN_COMPONENT, RunError, exception_place
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, ErrorCode, Path
from simscen.spec.base import Component
from simscen.stack.protocols import NavigationFailure
from simscen.stack.setting import Setting

P = ParamSpec("P")
T = TypeVar("T")


class CheckedPlugin:
    """Wrapper that raises RunError if the wrapped object, `inner`, returns an invalid value or raises an exception.

    The parameter `prefix` of methods is the start of an error message, such as "returned".
    """

    may_fail: ClassVar[bool] = True
    """Whether the wrapped object may raise NavigationFailure."""

    def __init__(self, role: str, spec: Component, setting: Setting, protocol: type) -> None:
        """Build the object. Raises RunError if a method of `protocol` is missing. `role` is for example "planner"."""
        self.role, self._spec = role, spec
        self.inner: Any = self.call(lambda: spec.implementation()(spec, setting))
        for name, value in vars(protocol).items():
            is_method = callable(value) and not name.startswith("_")
            if is_method and not callable(getattr(self.inner, name, None)):
                self.raise_invalid(f"{type(self.inner).__name__} has no method `{name}`, which every {role} needs")

    @property
    def label(self) -> str:
        """Name in messages, e.g. "planner `theta_star` (theta_star.planner:ThetaStar)"."""
        kind = getattr(self._spec, "type", "")
        return f"{self.role} `{kind}` ({self._spec.component})" if kind else f"{self.role} ({self._spec.component})"

    def call(self, method: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a method of the wrapped object, and return its result. See `raise_as_run_error` for exceptions."""
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
        message = f"{self.label}: {type(error).__name__}: {error} ({exception_place(error, self._spec.component)})"
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

    def checked_belief(self, belief: object, before: Belief | None) -> Belief:
        """Return the belief if it is finite and its arrays have the right shapes; otherwise raise RunError.

        `before` is the previous valid belief. The objects that both beliefs share are not checked again:
        `map_from_odom`, and particles if they are read-only.
        """
        if not isinstance(belief, Belief):
            self.raise_invalid(f"returned {type(belief).__name__} instead of a Belief")
        self.checked_pose(belief.pose, "returned a Belief with the pose")
        if before is None or belief.map_from_odom is not before.map_from_odom:
            self.checked_pose(belief.map_from_odom, "returned a Belief with `map_from_odom`")
        if not _is_finite_table(belief.covariance, 3) or len(belief.covariance) != 3:
            self.raise_invalid("returned a Belief whose covariance is not a finite array (3, 3)")
        is_checked = (
            before is not None and belief.particles is before.particles and not belief.particles.flags.writeable
        )
        if not is_checked and not _is_finite_table(belief.particles, 4):
            self.raise_invalid("returned a Belief whose particles are not a finite array (n, 4)")
        return belief


def are_numbers(values: Iterable[object]) -> bool:
    """Return whether all values are finite real numbers."""
    try:
        return math.isfinite(math.hypot(*values))  # type: ignore[arg-type]  # other types raise
    except (TypeError, OverflowError):
        return False


def all_finite(values: Array) -> bool:
    """Return whether all numbers of an array are finite."""
    # The sum of squares is faster to check. It can overflow for finite numbers.
    return math.isfinite(np.vdot(values, values)) or bool(np.isfinite(values).all())


def _shape_text(points: object) -> str:
    """Return the shape of an array, or the name of another type, for a message."""
    return str(points.shape) if isinstance(points, np.ndarray) else type(points).__name__


def _is_finite_table(value: object, columns: int) -> bool:
    """Return whether a value is an array (n, `columns`) of finite numbers."""
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "fiu":
        return False
    return value.shape[1:] == (columns,) and all_finite(value)
