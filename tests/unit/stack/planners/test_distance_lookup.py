"""Test of the distance lookup of pose searches."""

import numpy as np

from simscen.model.costmaps import Costmap as Spec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.footprint import distances
from simscen.stack.planners.pose_search import DistanceLookup
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot


def test_distance_lookup_equals_the_costmap_and_is_negative_outside() -> None:
    world = Flatland().room(8, 6)
    view = LayeredCostmap(Spec(), Surroundings(round_robot(), world.grid((-0.5, -0.5, 8.5, 6.5)), TICK_RATE_HZ)).view
    lookup = DistanceLookup(view)
    for x, y in np.random.default_rng(1).uniform((0, 0), (8, 6), (50, 2)).tolist():
        assert lookup.distance(x, y) == distances(view, np.array([[x, y]]))[0]
    assert lookup.distance(-3.0, 1.0) == -1.0
