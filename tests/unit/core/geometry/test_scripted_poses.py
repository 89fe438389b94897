"""Test of the search for scripted objects that stay far from a position."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose3
from simscen.core.geometry.scripted_poses import PredictedPoses


@pytest.mark.parametrize("distance", [0.5, 8.0, 20.0, math.inf])
def test_object_is_far_only_if_far_at_every_tick(distance: float) -> None:
    rng, names = np.random.default_rng(5), tuple(f"cart {number}" for number in range(40))
    table = rng.normal(0, 3, (20, 40, 7)) + rng.normal(0, 12, (40, 7))
    predicted = PredictedPoses(range(20), names, table, {name: Pose3() for name in ("shelf", *names)})
    position = (3.0, -2.0, 0.5)
    nearest = {name: min(math.dist(predicted.at(tick)[name][:3], position) for tick in range(20)) for name in names}
    far = predicted.farther_than(position, distance)
    assert far == {name for name, nearest_distance in nearest.items() if nearest_distance > distance}
    assert (len(far) > 0) == (distance < math.inf)
    assert (len(far) < 40) == (distance > 0.5)
