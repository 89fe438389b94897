"""Test of normal random numbers that are drawn in blocks."""

import numpy as np

from simscen.core.random_streams import Streams
from simscen.sensors.sensor import BUFFER_SIZE, NormalStream


def test_batched_draws_equal_single_draws_bit_for_bit():
    stream, rng = NormalStream(Streams(7).generator("sensor.imu")), Streams(7).generator("sensor.imu")
    for count in (6, 3, BUFFER_SIZE - 1, 1, 2 * BUFFER_SIZE, 5):
        assert stream.take(count) == np.array([rng.standard_normal() for _ in range(count)]).tolist()
