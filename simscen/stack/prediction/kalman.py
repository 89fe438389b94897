"""Constant velocity, many at once: the Kalman filter of a point in the plane whose velocity wanders.

State x, y, vx, vy; white acceleration, constant within a step (Bar-Shalom, Li, Kirubarajan 2001, section 6.3.2). The
same as filterpy's KalmanFilter with Q_discrete_white_noise, for n points in a few array operations. (Importing filterpy
takes longer than half a run.)
"""

import numpy as np

from simscen.core.geometry import Array


def predicted(states: Array, covariances: Array, seconds: float, acceleration: float) -> tuple[Array, Array]:
    """States (n, 4) and covariances (n, 4, 4) so much later; `acceleration` is its standard deviation in m/s²."""
    step = np.eye(4)
    step[0, 2] = step[1, 3] = seconds
    gain = np.array([[0.5 * seconds**2, 0.0], [0.0, 0.5 * seconds**2], [seconds, 0.0], [0.0, seconds]])
    return states @ step.T, step @ covariances @ step.T + acceleration**2 * (gain @ gain.T)


def corrected(states: Array, covariances: Array, measured: Array, deviations: Array) -> tuple[Array, Array]:
    """The same after positions (n, 2) were measured, with standard deviations (n,) in m alike in all directions."""
    noise = (deviations**2)[:, None, None] * np.eye(2)
    innovation = covariances[:, :2, :2] + noise
    gain = covariances[:, :, :2] @ np.linalg.inv(innovation)
    states = states + (gain @ (measured - states[:, :2])[:, :, None])[:, :, 0]
    kept = np.eye(4) - np.concatenate((gain, np.zeros_like(gain)), axis=2)
    # Joseph's form, which rounding cannot make indefinite.
    covariances = kept @ covariances @ kept.transpose(0, 2, 1) + gain @ noise @ gain.transpose(0, 2, 1)
    return states, covariances
