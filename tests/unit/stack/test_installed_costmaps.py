"""Tests of the costmaps that a stack from an installed package publishes."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from simscen.core.errors import RunError
from simscen.core.random_streams import Streams
from simscen.plugin import STOP, CostGrid, Decision, InProcessStack, OccupancyGrid, Setting, Surroundings
from simscen.stack.validation.stack import CheckedStack
from simscen.testing.flatland import round_robot

GRID = OccupancyGrid(np.zeros((3, 4), dtype=np.int8), 0.1)
FLOAT_CELLS: Any = OccupancyGrid(np.zeros((3, 4)), 0.1)  # type: ignore[arg-type]
ONE_DIMENSIONAL = OccupancyGrid(np.zeros(12, dtype=np.int8), 0.1)


def checked_decision(*costmaps: Any) -> Decision:
    """Return the decision of a stack that publishes these costmaps, after the checks of `CheckedStack`."""
    methods = dict.fromkeys(("start", "preempt", "cancel"), lambda *_: None)
    stack = SimpleNamespace(
        **methods, plan=None, goal=None, decide=lambda tick, readings: Decision(STOP, costmaps=costmaps)
    )

    class StackSpec(InProcessStack):
        """Stack of a package."""

        component = "some:Stack"

        @classmethod
        def implementation(cls) -> Any:
            return lambda spec, setting: stack

    setting = Setting(Surroundings(round_robot(), None, 240), "stack", Streams(1), 0.1)
    return CheckedStack(StackSpec(), setting).decide(0, ())


def test_costmaps_are_passed_unchanged() -> None:
    both = (CostGrid("global", "map", GRID), CostGrid("local", "odom", GRID))
    assert checked_decision(*both).costmaps == both


@pytest.mark.parametrize(
    ("costmap", "text"),
    [
        (GRID, "published OccupancyGrid instead of a CostGrid"),
        (CostGrid("local", "odom", None), "instead of a CostGrid"),  # type: ignore[arg-type]
        (CostGrid("mine", "odom", GRID), "a costmap 'mine' in frame 'odom'"),
        (CostGrid("local", "base", GRID), "a costmap 'local' in frame 'base'"),
        (CostGrid("local", "odom", FLOAT_CELLS), "a local costmap whose cells are no"),
        (CostGrid("global", "map", ONE_DIMENSIONAL), "a global costmap whose cells are no"),
    ],
)
def test_invalid_costmap_is_named(costmap: Any, text: str) -> None:
    with pytest.raises(RunError, match=text):
        checked_decision(costmap)
