"""The filter of many points at once, beside filterpy's of one."""

import numpy as np
import pytest
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter

from simscen.stack.prediction.kalman import corrected, predicted


def test_it_is_filterpys_filter_for_each_point() -> None:
    chance = np.random.default_rng(3)
    seconds, acceleration = 0.1, 1.5
    states = chance.normal(size=(3, 4))
    covariances = np.stack([np.diag([0.1, 0.2, 1.0, 1.5]) * (k + 1) for k in range(3)])
    oracles = []
    for state, covariance in zip(states, covariances, strict=True):
        oracle = KalmanFilter(dim_x=4, dim_z=2)
        oracle.x, oracle.P = state.copy(), covariance.copy()
        oracle.F = np.eye(4) + seconds * np.eye(4, k=2)
        # filterpy orders x, vx, y, vy; ours is x, y, vx, vy.
        one = Q_discrete_white_noise(2, seconds, acceleration**2)
        order = [0, 2, 1, 3]
        oracle.Q = np.kron(np.eye(2), one)[np.ix_(order, order)]
        oracle.H = np.eye(2, 4)
        oracles.append(oracle)
    for _ in range(5):
        measured, deviations = chance.normal(size=(3, 2)), chance.uniform(0.01, 0.2, 3)
        states, covariances = predicted(states, covariances, seconds, acceleration)
        states, covariances = corrected(states, covariances, measured, deviations)
        for k, oracle in enumerate(oracles):
            oracle.predict()
            oracle.update(measured[k], R=np.eye(2) * deviations[k] ** 2)
            assert states[k] == pytest.approx(oracle.x, abs=1e-9)
            assert covariances[k] == pytest.approx(oracle.P, abs=1e-9)
