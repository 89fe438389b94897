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


def build_component(door: Callable[[S, Setting], T], spec: S, setting: Setting) -> T:
    """Build a component: with checks if it comes from another package, without if it ships with simscen.

    A stack of shipped parts has one door, its own, which looks at what is decided rather than at every answer.
    """
    component: T = (spec.implementation() if spec.component.startswith("simscen.") else door)(spec, setting)
    return component


class CheckedPlugin:
    """Base class of the wrappers of installed components; `role` is their role in a stack.

    An exception that is no NavigationFailure is the component's own fault, and an answer that is none (not finite, not
    of its shape) is found where it comes from rather than three components later. Neither says anything of a scenario,
    so both end the run with an error and not with a verdict.
    """

    may_fail: ClassVar[bool] = True
    """Whether a component of this role may raise NavigationFailure."""

    def __init__(self, role: str, spec: Component, setting: Setting, protocol: type) -> None:
        self.role, self._spec = role, spec
        self.inner: Any = self.ask(lambda: spec.implementation()(spec, setting))
        for name in promised(protocol):
            if not callable(getattr(self.inner, name, None)):
                self.broke(f"{type(self.inner).__name__} has no `{name}`, which every {role} has")

    @property
    def label(self) -> str:
        """Name in messages, e.g. "planner `theta_star` (theta_star.planner:ThetaStar)"."""
        kind = getattr(self._spec, "type", "")
        return f"{self.role} `{kind}` ({self._spec.component})" if kind else f"{self.role} ({self._spec.component})"

    def ask(self, method: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a method. A NavigationFailure passes; any other exception is an error of the component."""
        try:
            return method(*args, **kwargs)
        except Exception as error:  # the boundary to code of others, which can raise anything
            self.raised(error)

    def raised(self, error: Exception) -> NoReturn:
        """Raise the error that corresponds to an exception of the component."""
        if isinstance(error, RunError | MemoryError):
            raise error
        if isinstance(error, NavigationFailure) and self.may_fail:
            if not isinstance(error.code, ErrorCode):
                self.broke(f"fails with {error.code!r}, which is no ErrorCode")
            raise error
        message = f"{self.label}: {type(error).__name__}: {error} ({self._place(error)})"
        raise RunError("crashed", message, by_stack=True) from error

    def broke(self, what: str) -> NoReturn:
        """End the run, because the component returned an invalid answer."""
        raise RunError(BROKEN_COMPONENT, f"{self.label} {what}", by_stack=True)

    def checked_path(self, path: object, what: str) -> Path:
        """Return the path if it consists of finite poses (n, 3)."""
        if not isinstance(path, Path):
            self.broke(f"{what} {type(path).__name__} instead of a Path")
        points = path.points
        if not isinstance(points, np.ndarray) or points.ndim != 2 or points.shape[1] != 3:
            self.broke(f"{what} a path whose points are {_shape(points)} instead of (n, 3): x, y, yaw")
        if points.dtype.kind != "f" or not all_finite(points):
            self.broke(f"{what} a path with points that are no finite numbers")
        return path

    def checked_twist(self, command: object) -> Twist:
        """Return the velocity if it consists of three finite numbers."""
        if not isinstance(command, Twist):
            self.broke(f"commanded {type(command).__name__} instead of a Twist")
        if not are_numbers(command):
            self.broke(f"commanded {tuple(command)}, which is no velocity")
        return command

    def checked_pose(self, pose: object, what: str) -> Pose2:
        """Return the pose if it consists of three finite numbers."""
        if not isinstance(pose, Pose2) or not are_numbers(pose):
            self.broke(f"{what} {pose!r}, which is no finite pose")
        return pose

    def _place(self, error: Exception) -> str:
        """Return the innermost line of the traceback in the component's package, or the innermost of all."""
        package = self._spec.component.partition(":")[0].partition(".")[0]
        frames = list(traceback.walk_tb(error.__traceback__))
        own = [at for at in frames if str(at[0].f_globals.get("__name__", "")).partition(".")[0] == package]
        frame, line = (own or frames)[-1]
        return f"{frame.f_code.co_filename.rpartition('/')[2]}:{line}"


def promised(protocol: type) -> list[str]:
    """Return the names of the methods of a protocol."""
    return [name for name, what in vars(protocol).items() if callable(what) and not name.startswith("_")]


def are_numbers(values: Iterable[object]) -> bool:
    """Return whether these are real, finite numbers."""
    try:
        return math.isfinite(math.hypot(*values))  # type: ignore[arg-type]  # what is none raises
    except TypeError:
        return False


def all_finite(values: Array) -> bool:
    """Return whether all numbers of an array are finite. A finite sum of squares proves it quickly."""
    return math.isfinite(np.vdot(values, values)) or bool(np.isfinite(values).all())


def _shape(points: object) -> str:
    return str(points.shape) if isinstance(points, np.ndarray) else type(points).__name__
