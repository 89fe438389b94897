"""Promises, and how they are checked: what the contracts of this kit are made of."""

from __future__ import annotations

import random
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import FrameType
from typing import Any, ClassVar, TypeVar

import numpy as np

from simscen.core.messages.navigation import ErrorCode
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.spec.base import Component
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.stack.setting import Setting
from simscen.testing.flatland import RATE, Flatland, setting

DEFAULT_LIMIT_S = 60.0
"""Seconds of wall time after which a promise counts as broken because its component does not come to an end."""

T = TypeVar("T")


class PromiseBroken(AssertionError):
    """A component does not keep what its protocol promises; the message says what was seen."""


def require(kept: object, seen: str) -> None:
    """Raise PromiseBroken, with what was seen, unless `kept`."""
    if not kept:
        raise PromiseBroken(seen)


@dataclass(frozen=True)
class Promise:
    """One promise of one subject: `str(promise)` is a sentence, `check()` raises PromiseBroken where it is not kept."""

    role: str
    subject: str
    name: str
    keep: Callable[[], None]

    def __str__(self) -> str:
        return f"{self.subject} {self.name}" if self.subject else self.name

    def check(self, limit: float = DEFAULT_LIMIT_S) -> None:
        """Try it, with global random generators in a state that no other try has."""
        reseed_global_generators()
        with time_limit(limit):
            self.keep()


def promise(method: Callable[[T], None]) -> Callable[[T], None]:
    """Marks a method of a contract as one of its promises; its name is the sentence, its docstring given … then …."""
    method.__is_promise__ = True  # type: ignore[attr-defined]
    return method


class Contract:
    """The promises of one role, for one subject. Each is tried on components that are built anew."""

    role: ClassVar[str]
    subject: str = ""

    def promises(self) -> list[Promise]:
        """All of them, in the order of the contract."""
        names = [n for kind in reversed(type(self).__mro__) for n, v in vars(kind).items() if _is_promise(v)]
        return [Promise(self.role, self.subject, n.replace("_", " "), getattr(self, n)) for n in dict.fromkeys(names)]


def _is_promise(value: Any) -> bool:
    return getattr(value, "__is_promise__", False)


_turn = 0


def reseed_global_generators() -> None:
    """Put the global generators of Python and numpy into a state of their own: who draws from them shows it."""
    global _turn  # noqa: PLW0603
    _turn += 1
    random.seed(_turn)
    np.random.seed(_turn)  # noqa: NPY002


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise PromiseBroken in what does not come to an end. Only the main thread can be interrupted."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def give_up(_number: int, frame: FrameType | None) -> None:
        where = f", at {frame.f_code.co_filename}:{frame.f_lineno}" if frame else ""
        raise PromiseBroken(f"does not come to an end within {seconds:g} s{where}")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@dataclass(frozen=True, eq=False)
class ComponentContract(Contract):
    """The promises of a component that is built as `Class(spec, setting)`, tried with this robot."""

    spec: Any
    robot: RobotModel
    subject: str = ""

    def setting(self) -> Setting:
        """Where it is installed; each has a fresh random generator."""
        return setting(self.robot, name=self.role)

    def built(self) -> Any:
        """A new one."""
        spec: Component = self.spec
        return call_component("is built", lambda: spec.implementation()(spec, self.setting()))


def call_component(when: str, call: Callable[..., T], *given: Any, **named: Any) -> T:
    """What a call answers. Raises PromiseBroken for every exception but a NavigationFailure with a code of Nav2's."""
    try:
        return call(*given, **named)
    except NavigationFailure as failure:
        require(isinstance(failure.code, ErrorCode), f"fails with {failure.code!r}, which is no ErrorCode")
        raise
    except PromiseBroken:
        raise
    except Exception as error:  # whatever a stranger's component raises
        what = f"raises {type(error).__name__} when it {when}, not a NavigationFailure: {error}"
        raise PromiseBroken(what) from error


def view_of(world: Flatland, robot: RobotModel, bounds: tuple[float, float, float, float]) -> CostmapView:
    """A costmap of all that is in the world, in cells of 5 cm."""
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid(bounds), RATE)).view


def copy_costmap(view: CostmapView) -> CostmapView:
    """The same costmap in arrays of its own."""
    return replace(view, costs=view.costs.copy(), distance=view.distance.copy())


def equal_costmaps(one: CostmapView, other: CostmapView) -> bool:
    """Whether two costmaps say the same."""
    return np.array_equal(one.costs, other.costs) and np.array_equal(one.distance, other.distance)


def overwrite_costmap(view: CostmapView) -> None:
    """What becomes of a costmap that somebody has kept: everything is lethal."""
    view.costs.setflags(write=True)
    view.distance.setflags(write=True)
    view.costs[:], view.distance[:] = 254, 0.0
