"""What the contracts of all components of a stack share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from simscen.core.messages.navigation import ErrorCode
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.spec.component import Component
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.stack.setting import Setting
from simscen.testing.flatland import RATE, Flatland, setting
from simscen.testing.promise import Contract, PromiseBroken, demand

T = TypeVar("T")


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
        return heard("is built", lambda: spec.implementation()(spec, self.setting()))


def heard(when: str, call: Callable[..., T], *given: Any, **named: Any) -> T:
    """What a call answers. Raises PromiseBroken for every exception but a NavigationFailure with a code of Nav2's."""
    try:
        return call(*given, **named)
    except NavigationFailure as failure:
        demand(isinstance(failure.code, ErrorCode), f"fails with {failure.code!r}, which is no ErrorCode")
        raise
    except PromiseBroken:
        raise
    except Exception as error:  # whatever a stranger's component raises
        what = f"raises {type(error).__name__} when it {when}, not a NavigationFailure: {error}"
        raise PromiseBroken(what) from error


def view_of(world: Flatland, robot: RobotModel, bounds: tuple[float, float, float, float]) -> CostmapView:
    """A costmap of all that is in the world, in cells of 5 cm."""
    return Costmap(CostmapSpec(), Surroundings(robot, world.grid(bounds), RATE)).view


def copied(view: CostmapView) -> CostmapView:
    """The same costmap in arrays of its own."""
    return replace(view, costs=view.costs.copy(), distance=view.distance.copy())


def same(one: CostmapView, other: CostmapView) -> bool:
    """Whether two costmaps say the same."""
    return np.array_equal(one.costs, other.costs) and np.array_equal(one.distance, other.distance)


def scribble(view: CostmapView) -> None:
    """What becomes of a costmap that somebody has kept: everything is lethal."""
    view.costs.setflags(write=True)
    view.distance.setflags(write=True)
    view.costs[:], view.distance[:] = 254, 0.0
