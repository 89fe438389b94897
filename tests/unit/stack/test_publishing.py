"""Tests of the rates at which costmaps are published."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.model.costmaps import Costmap, LocalCostmap
from simscen.stack.frames import Frames
from simscen.stack.protocols import CostmapView
from simscen.stack.publishing import Publisher
from simscen.testing.flatland import TICK_RATE_HZ

FRAMES = Frames(Pose2(0.0, 0.0), Pose2(0.0, 0.0))


class ChangingCostmap:
    """Costmap with a new revision in each view."""

    def __init__(self, frequency: float, cells: int = 100) -> None:
        self.publish_frequency, self._revision, self._shape = frequency, 0, (cells, 1)

    @property
    def view(self) -> CostmapView:
        self._revision += 1
        zeros = np.zeros(self._shape)
        return CostmapView(zeros.astype(np.uint8), zeros.astype(np.float32), 0.05, (0.0, 0.0), self._revision)


def publication_counts(costmaps: Any, seconds: float = 10.0) -> dict[str, int]:
    """Return how often each costmap is published."""
    publisher = Publisher(TICK_RATE_HZ, SimpleNamespace(), SimpleNamespace())  # type: ignore[arg-type]
    counts = {"global": 0, "local": 0}
    for tick in range(0, round(seconds * TICK_RATE_HZ), 12):
        for grid in publisher.updates(tick, FRAMES, None, costmaps)[2]:
            counts[grid.name] += 1
    return counts


@pytest.mark.parametrize(
    ("frequencies", "expected"),
    [((0.5, 1.0), (5, 10)), ((2.0, 5.0), (20, 50)), ((0.0, 1.0), (0, 10)), ((0.5, 0.0), (5, 0))],
)
def test_costmaps_are_published_at_their_publish_frequency(frequencies, expected) -> None:
    global_costmap, local_costmap = map(ChangingCostmap, frequencies)
    counts = publication_counts(SimpleNamespace(global_costmap=global_costmap, local_costmap=local_costmap))
    assert (counts["global"], counts["local"]) == expected


def test_large_costmaps_are_published_less_often() -> None:
    large = ChangingCostmap(5.0, cells=250_000)
    counts = publication_counts(SimpleNamespace(global_costmap=large, local_costmap=ChangingCostmap(5.0)))
    assert counts == {"global": 5, "local": 50}


def test_default_publish_frequencies_are_half_of_those_of_nav2() -> None:
    """nav2_params.yaml has 1 Hz and 2 Hz."""
    assert (Costmap().publish_frequency, LocalCostmap().publish_frequency) == (0.5, 1.0)
    assert LocalCostmap().with_defaults_from(Costmap()).publish_frequency == 1.0
