"""Test of the Kalman filter of obstacle positions against filterpy."""

import numpy as np
import pytest
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter

from simscen.advanced.prediction.tracks import ConstantVelocityFilter


def test_constant_velocity_filter_equals_filterpy() -> None:
    rng = np.random.default_rng(3)
    seconds, acceleration = 0.1, 1.5
    state, covariance = rng.normal(size=4), np.kron([[0.1, 0.02], [0.02, 1.5]], np.eye(2))
    point = ConstantVelocityFilter(complex(*state[:2]), complex(*state[2:]), 0.1, 0.02, 1.5)
    reference = KalmanFilter(dim_x=4, dim_z=2)
    reference.x, reference.P = state.copy(), covariance
    reference.F = np.eye(4) + seconds * np.eye(4, k=2)
    # filterpy orders x, vx, y, vy; ours is x, y, vx, vy.
    order = [0, 2, 1, 3]
    reference.Q = np.kron(np.eye(2), Q_discrete_white_noise(2, seconds, acceleration**2))[np.ix_(order, order)]
    reference.H = np.eye(2, 4)
    for _ in range(5):
        measured, deviation = rng.normal(size=2), float(rng.uniform(0.01, 0.2))
        point.predict(seconds, acceleration)
        point.correct(complex(*measured), deviation)
        reference.predict()
        reference.update(measured, R=np.eye(2) * deviation**2)
        state_estimate = [point.position.real, point.position.imag, point.velocity.real, point.velocity.imag]
        assert state_estimate == pytest.approx(reference.x, abs=1e-9)
        axis_covariance = [[point.variance, point.covariance], [point.covariance, point.velocity_variance]]
        assert np.kron(axis_covariance, np.eye(2)) == pytest.approx(reference.P, abs=1e-9)
