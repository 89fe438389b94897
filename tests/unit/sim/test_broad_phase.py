"""Tests of the broad phase."""

import numpy as np
import pytest

from simscen.sim.objects.actor import SPEED_HORIZON_S
from simscen.sim.objects.broad_phase import NEAR_CONTACT_S, BoundingDiscs, find_candidates


def test_bodies_do_not_meet_within_the_guaranteed_time():
    rng = np.random.default_rng(5)
    for _ in range(300):
        scripted = BoundingDiscs(rng.uniform(-2, 2, (3, 2)), rng.uniform(0.1, 0.3, 3), rng.uniform(0, 2, 3))
        pushable = BoundingDiscs(rng.uniform(-2, 2, (4, 2)), rng.uniform(0.1, 0.3, 4), rng.uniform(0, 1, 4))
        candidates = find_candidates(scripted, pushable, hit_speed=1.5)
        assert 0 < candidates.seconds <= SPEED_HORIZON_S
        distances = np.linalg.norm(scripted.centers[:, None] - pushable.centers, axis=2)
        reach = scripted.radii[:, None] + pushable.radii + candidates.seconds * (scripted.speeds[:, None] + 1.5)
        for mover, pushed in np.argwhere(distances < reach).tolist():
            assert mover in candidates.scripted
            assert pushed in candidates.pushable


def test_distant_bodies_are_skipped_and_jumping_bodies_are_checked():
    far = BoundingDiscs.of([((9.0, 0.0, 0.0), 0.3, 0.0)])
    assert find_candidates(BoundingDiscs.of([((0.0, 0.0, 0.0), 0.3, 1.0)]), far, 1.0) == ((), (), SPEED_HORIZON_S)
    assert find_candidates(BoundingDiscs.of([((0.0, 0.0, 0.0), 0.3, np.inf)]), far, 1.0) == ((0,), (0,), NEAR_CONTACT_S)
    assert find_candidates(BoundingDiscs.of([]), far, 1.0) == ((), (), pytest.approx(SPEED_HORIZON_S))
