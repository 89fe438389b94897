"""Tests of costmaps published by stacks of packages."""

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
FLOATS: Any = OccupancyGrid(np.zeros((3, 4)), 0.1)  # type: ignore[arg-type]
FLAT = OccupancyGrid(np.zeros(12, dtype=np.int8), 0.1)


def decided(*costmaps: Any) -> Decision:
    """What a stack decides that shows these, as far as it gets through the door."""
    calls = dict.fromkeys(("start", "preempt", "cancel"), lambda *_: None)
    shows = SimpleNamespace(
        **calls, plan=None, goal=None, decide=lambda tick, readings: Decision(STOP, costmaps=costmaps)
    )

    class Shows(InProcessStack):
        """A stack of somebody's."""

        component = "some:Stack"

        @classmethod
        def implementation(cls) -> Any:
            return lambda spec, setting: shows

    setting = Setting(Surroundings(round_robot(), None, 240), "stack", Streams(1), 0.1)
    return CheckedStack(Shows(), setting).decide(0, ())


def test_costmaps_are_passed_unchanged() -> None:
    both = (CostGrid("global", "map", GRID), CostGrid("local", "odom", GRID))
    assert decided(*both).costmaps == both


@pytest.mark.parametrize(
    ("costmap", "text"),
    [
        (GRID, "published OccupancyGrid instead of a CostGrid"),
        (CostGrid("local", "odom", None), "instead of a CostGrid"),  # type: ignore[arg-type]
        (CostGrid("mine", "odom", GRID), "a costmap 'mine' in frame 'odom'"),
        (CostGrid("local", "base", GRID), "a costmap 'local' in frame 'base'"),
        (CostGrid("local", "odom", FLOATS), "a local costmap whose cells are no"),
        (CostGrid("global", "map", FLAT), "a global costmap whose cells are no"),
    ],
)
def test_invalid_costmap_is_named(costmap: Any, text: str) -> None:
    with pytest.raises(RunError, match=text):
        decided(costmap)
