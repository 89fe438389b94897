"""Test of the point filter against filterpy."""

import numpy as np
import pytest
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter

from simscen.advanced.prediction.tracks import ConstantVelocityFilter


def test_point_filter_matches_filterpy_per_axis() -> None:
    rng = np.random.default_rng(3)
    seconds, acceleration = 0.1, 1.5
    state, covariance = rng.normal(size=4), np.kron([[0.1, 0.02], [0.02, 1.5]], np.eye(2))
    point = ConstantVelocityFilter(complex(*state[:2]), complex(*state[2:]), 0.1, 0.02, 1.5)
    oracle = KalmanFilter(dim_x=4, dim_z=2)
    oracle.x, oracle.P = state.copy(), covariance
    oracle.F = np.eye(4) + seconds * np.eye(4, k=2)
    # filterpy orders x, vx, y, vy; ours is x, y, vx, vy.
    order = [0, 2, 1, 3]
    oracle.Q = np.kron(np.eye(2), Q_discrete_white_noise(2, seconds, acceleration**2))[np.ix_(order, order)]
    oracle.H = np.eye(2, 4)
    for _ in range(5):
        measured, deviation = rng.normal(size=2), float(rng.uniform(0.01, 0.2))
        point.predict(seconds, acceleration)
        point.correct(complex(*measured), deviation)
        oracle.predict()
        oracle.update(measured, R=np.eye(2) * deviation**2)
        known = [point.position.real, point.position.imag, point.velocity.real, point.velocity.imag]
        assert known == pytest.approx(oracle.x, abs=1e-9)
        spread = [[point.variance, point.covariance], [point.covariance, point.velocity_variance]]
        assert np.kron(spread, np.eye(2)) == pytest.approx(oracle.P, abs=1e-9)
