"""Tests of motion prediction with several lidars."""

import math

import numpy as np
import pytest

from simscen.advanced.prediction.motion_prediction import MotionPrediction
from simscen.advanced.prediction.tracks import HIDDEN_TIMEOUT_S
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Prediction
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot

ORIGIN = Pose2(0.0, 0.0)
PERIOD_TICKS = TICK_RATE_HZ // 10
STEP_RAD = math.tau / 720


def feed(prediction: MotionPrediction, interval_s: tuple[float, float], *lidars: str) -> None:
    """Pass the scans of the lidars between two times to the motion prediction.

    Only the lidar `front` measures a disc, which moves at 0.8 m/s through a room at x = 3 m.
    """
    for tick in range(round(interval_s[0] * TICK_RATE_HZ), round(interval_s[1] * TICK_RATE_HZ), PERIOD_TICKS):
        disc = (3.0, 0.8 * tick / TICK_RATE_HZ - 1.5, 0.3)
        angles = STEP_RAD * np.arange(720) - math.pi
        for lidar in lidars:
            discs = [disc] if lidar == "front" else []
            ranges = Flatland([(8.0, -9.0, 8.2, 9.0), (-8.2, -9.0, -8.0, 9.0)], discs).cast((0.0, 0.0), angles)
            prediction.on_scan(Scan(lidar, tick, ranges, -math.pi, STEP_RAD, 0.05, 12.0))


@pytest.mark.parametrize(("silence_s", "is_kept"), [(0.5 * HIDDEN_TIMEOUT_S, True), (2.0 * HIDDEN_TIMEOUT_S, False)])
def test_obstacles_of_a_lidar_that_has_failed_are_forgotten(silence_s: float, is_kept: bool) -> None:
    prediction = MotionPrediction(Prediction(enabled=True), round_robot(), ("front", "rear"), TICK_RATE_HZ, 0.5)
    feed(prediction, (0.0, 3.0), "front", "rear")
    assert len(prediction.moving_obstacles_in_frame(3 * TICK_RATE_HZ, ORIGIN)) == 1
    feed(prediction, (3.0, 3.0 + silence_s), "rear")
    end = round((3.0 + silence_s) * TICK_RATE_HZ)
    assert len(prediction.moving_obstacles_in_frame(end, ORIGIN)) == is_kept
    assert prediction.is_idle != is_kept
