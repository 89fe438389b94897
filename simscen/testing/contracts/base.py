"""Base classes of contracts and promises, and helpers for checks.

A promise is one rule of a protocol, such as the protocol of planners. A contract has all promises of one protocol.
"""

from __future__ import annotations

import random
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from types import FrameType
from typing import Any, ClassVar, TypeVar

import numpy as np

from simscen.core.messages.navigation import ErrorCode
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.spec.base import Component
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, setting

DEFAULT_LIMIT_S = 60.0
"""Wall time after which a promise counts as broken because the component does not return."""

T = TypeVar("T")


class PromiseBroken(AssertionError):
    """A component breaks a promise of its protocol. The message states the observation."""


def require(condition: object, observation: str) -> None:
    """Raise PromiseBroken with this message if the condition is false."""
    if not condition:
        raise PromiseBroken(observation)


@dataclass(frozen=True)
class Promise:
    """One rule of a protocol, to be checked for one component.

    role:    kind of component, such as "planner"
    subject: name of the component in reports
    name:    the promise as a sentence
    verify:  function that raises PromiseBroken if the component breaks the promise
    """

    role: str
    subject: str
    name: str
    verify: Callable[[], None]

    def __str__(self) -> str:
        return f"{self.subject} {self.name}" if self.subject else self.name

    def check(self, limit: float = DEFAULT_LIMIT_S) -> None:
        """Check the promise within `limit` seconds. Raises PromiseBroken."""
        reseed_global_generators()
        try:
            with time_limit(limit):
                self.verify()
        except NavigationFailure as failure:  # a promise that allows failures catches them itself
            raise PromiseBroken(f"fails with {getattr(failure.code, 'name', failure.code)}: {failure}") from None


def promise(method: Callable[[T], None]) -> Callable[[T], None]:
    """Mark a method of a contract as a promise (decorator).

    The name of the method is the reported sentence. Its docstring has the form "Given SITUATION then RESULT".
    """
    method.__is_promise__ = True  # type: ignore[attr-defined]
    return method


@dataclass(frozen=True, eq=False)
class Contract:
    """All promises of one kind of component, to be checked for the component that `spec` specifies.

    `role` is the kind of component, such as "planner". `subject` is the name of the component in reports.
    """

    role: ClassVar[str]
    spec: Any
    subject: str = ""

    def promises(self) -> list[Promise]:
        """Return all promises in the order of their definition."""
        members = [member for kind in reversed(type(self).__mro__) for member in vars(kind).items()]
        names = [name for name, value in members if hasattr(value, "__is_promise__")]
        return [Promise(self.role, self.subject, n.replace("_", " "), getattr(self, n)) for n in dict.fromkeys(names)]


_reseed_count = 0


def reseed_global_generators() -> None:
    """Give the global random generators of Python and numpy a new seed, to detect components that use them."""
    global _reseed_count  # noqa: PLW0603
    _reseed_count += 1
    random.seed(_reseed_count)
    np.random.seed(_reseed_count)  # noqa: NPY002


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise PromiseBroken if the block takes longer than `seconds`. The limit works only in the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def raise_timeout(_number: int, frame: FrameType | None) -> None:
        where = f", at {frame.f_code.co_filename}:{frame.f_lineno}" if frame else ""
        raise PromiseBroken(f"does not return within {seconds:g} s{where}")

    previous = signal.signal(signal.SIGALRM, raise_timeout)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)


@dataclass(frozen=True, eq=False)
class ComponentContract(Contract):
    """Contract of a component that is built for one robot, from its specification and a Setting."""

    robot: RobotModel = field(kw_only=True)

    def build(self) -> Any:
        """Build a new component with a fixed seed and without a map. Raises PromiseBroken for any exception."""
        spec: Component = self.spec
        return call_component("is built", lambda: spec.implementation()(spec, setting(self.robot, name=self.role)))


def call_component(action: str, call: Callable[..., T], *args: Any, **kwargs: Any) -> T:
    """Call a method of a component, and return the result.

    Raises NavigationFailure if the component fails with an ErrorCode, and PromiseBroken for any other exception.
    `action` describes the call in messages, such as "plans" in "raises TypeError when it plans".
    """
    try:
        return call(*args, **kwargs)
    except NavigationFailure as failure:
        require(isinstance(failure.code, ErrorCode), f"fails with {failure.code!r}, which is not an ErrorCode")
        raise
    except PromiseBroken:
        raise
    except Exception as error:  # plug-ins can raise anything
        message = f"raises {type(error).__name__} when it {action}: {error}"
        raise PromiseBroken(message) from error


def costmap_of_world(world: Flatland, robot: RobotModel, bounds: tuple[float, float, float, float]) -> CostmapView:
    """Return the costmap of the area `bounds` (min x, min y, max x, max y) of the world, with cells of 5 cm."""
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, world.grid(bounds), TICK_RATE_HZ)).view


def copy_costmap(view: CostmapView) -> CostmapView:
    """Return a deep copy of a costmap."""
    return replace(view, costs=view.costs.copy(), distance=view.distance.copy())


def are_equal_costmaps(one: CostmapView, other: CostmapView) -> bool:
    """Return whether two costmaps have the same costs and distances."""
    return np.array_equal(one.costs, other.costs) and np.array_equal(one.distance, other.distance)


def overwrite_costmap(view: CostmapView) -> None:
    """Make all cells of a costmap lethal in place, to detect components that still use this costmap."""
    view.costs.setflags(write=True)
    view.distance.setflags(write=True)
    view.costs[:], view.distance[:] = 254, 0.0
