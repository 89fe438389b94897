"""Base class of plugin wrappers: a faulty plugin ends the run with an error that names it."""

import math
import traceback
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, NoReturn, ParamSpec, TypeVar

import numpy as np

from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.spec.base import Component
from simscen.stack.protocols import NavigationFailure
from simscen.stack.setting import Setting

P = ParamSpec("P")
T = TypeVar("T")


S = TypeVar("S", bound=Component)


def build_component(wrapper: Callable[[S, Setting], T], spec: S, setting: Setting) -> T:
    """Build a component: with checks if it comes from another package, without if it ships with simscen.

    A stack of components that ship with simscen is checked as a whole, by its decisions.
    """
    component: T = (spec.implementation() if spec.component.startswith("simscen.") else wrapper)(spec, setting)
    return component


class CheckedPlugin:
    """Base class of the wrappers of installed components; `role` is their role in a stack.

    An exception other than NavigationFailure, or an invalid return value (not finite, wrong shape), is a fault of the
    component. Since it says nothing about the scenario, it ends the run with an error instead of a verdict.
    """

    may_fail: ClassVar[bool] = True
    """Whether a component of this role may raise NavigationFailure."""

    def __init__(self, role: str, spec: Component, setting: Setting, protocol: type) -> None:
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
        """Call a method. Any exception other than NavigationFailure becomes a RunError that names the component."""
        try:
            return method(*args, **kwargs)
        except Exception as error:  # code of other packages can raise anything
            self.raise_as_run_error(error)

    def raise_as_run_error(self, error: Exception) -> NoReturn:
        """Raise the error that corresponds to an exception of the component."""
        if isinstance(error, RunError | MemoryError):
            raise error
        if isinstance(error, NavigationFailure) and self.may_fail:
            if not isinstance(error.code, ErrorCode):
                self.raise_invalid(f"failed with {error.code!r}, which is not an ErrorCode")
            raise error
        message = f"{self.label}: {type(error).__name__}: {error} ({self._location(error)})"
        raise RunError("crashed", message, by_stack=True) from error

    def raise_invalid(self, what: str) -> NoReturn:
        """Raise the RunError of a component that returned an invalid value; `what` follows its name in the message."""
        raise RunError(BROKEN_COMPONENT, f"{self.label} {what}", by_stack=True)

    def checked_path(self, path: object, what: str) -> Path:
        """Return the path if it consists of finite poses (n, 3)."""
        if not isinstance(path, Path):
            self.raise_invalid(f"{what} {type(path).__name__} instead of a Path")
        points = path.points
        if not isinstance(points, np.ndarray) or points.ndim != 2 or points.shape[1] != 3:
            self.raise_invalid(f"{what} a path whose points are {_shape(points)} instead of (n, 3): x, y, yaw")
        if points.dtype.kind != "f" or not all_finite(points):
            self.raise_invalid(f"{what} a path with points that are not finite numbers")
        return path

    def checked_twist(self, command: object) -> Twist:
        """Return the velocity if it consists of three finite numbers."""
        if not isinstance(command, Twist):
            self.raise_invalid(f"commanded {type(command).__name__} instead of a Twist")
        if not are_numbers(command):
            self.raise_invalid(f"commanded {tuple(command)}, which is not a finite velocity")
        return command

    def checked_pose(self, pose: object, what: str) -> Pose2:
        """Return the pose if it consists of three finite numbers."""
        if not isinstance(pose, Pose2) or not are_numbers(pose):
            self.raise_invalid(f"{what} {pose!r}, which is not a finite pose")
        return pose

    def _location(self, error: Exception) -> str:
        """Return the innermost line of the traceback in the component's package, or the innermost of all."""
        package = self._spec.component.partition(":")[0].partition(".")[0]
        frames = list(traceback.walk_tb(error.__traceback__))
        own = [entry for entry in frames if str(entry[0].f_globals.get("__name__", "")).partition(".")[0] == package]
        frame, line = (own or frames)[-1]
        return f"{frame.f_code.co_filename.rpartition('/')[2]}:{line}"


def method_names(protocol: type) -> list[str]:
    """Return the names of the methods of a protocol."""
    return [name for name, value in vars(protocol).items() if callable(value) and not name.startswith("_")]


def are_numbers(values: Iterable[object]) -> bool:
    """Return whether these are real, finite numbers."""
    try:
        return math.isfinite(math.hypot(*values))  # type: ignore[arg-type]  # other types raise
    except TypeError:
        return False


def all_finite(values: Array) -> bool:
    """Return whether all numbers of an array are finite. A finite sum of squares proves it quickly."""
    return math.isfinite(np.vdot(values, values)) or bool(np.isfinite(values).all())


def _shape(points: object) -> str:
    return str(points.shape) if isinstance(points, np.ndarray) else type(points).__name__
