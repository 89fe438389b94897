"""Tests of random streams: reproducible, and independent of other streams."""

import numpy as np
import pytest

from simscen.core.random_streams import MAX_SEED, Streams


def test_the_same_seed_and_name_give_the_same_stream():
    first, second = Streams(7).generator("sensor.lidar"), Streams(7).generator("sensor.lidar")
    assert np.array_equal(first.normal(size=1000), second.normal(size=1000))


@pytest.mark.parametrize(("seed", "name"), [(8, "sensor.lidar"), (7, "sensor.odom")])
def test_another_seed_or_name_gives_another_stream(seed, name):
    draws = Streams(7).generator("sensor.lidar").random(1000)
    other = Streams(seed).generator(name).random(1000)
    assert abs(np.corrcoef(draws, other)[0, 1]) < 0.15  # 0.15 = 4.7 standard errors of 1000 independent pairs


def test_integers_for_engines_lie_in_their_range():
    seeds = [Streams(seed).library_seed("planner#1") for seed in range(1, 500)]
    assert min(seeds) >= 1
    assert max(seeds) <= MAX_SEED
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize("seed", [0, -1, MAX_SEED + 1])
def test_a_seed_out_of_range_is_refused(seed):
    with pytest.raises(ValueError, match="seed must be in"):
        Streams(seed)
