"""Where the velocities that DWB tries lead: dwb_plugins' StandardTrajectoryGenerator."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.motion import Twist
from simscen.stack.controllers.dwb.kinematics import Kinematics


def trajectories(
    pose: Pose2, now: Twist, velocities: Array, kinematics: Kinematics, seconds: float, metres: float, radians: float
) -> Array:
    """Poses (n, steps, 3), the first being `pose`, of a base that changes to each of the velocities (n, 3).

    A trajectory has as many steps as it takes for none to be longer than `metres` or to turn by more than `radians`
    at its velocity; those with fewer than others stay at their end. Each step keeps the heading it begins with.
    """
    linear = np.hypot(velocities[:, 0], velocities[:, 1]) * seconds / metres
    counts = np.maximum(1.0, np.ceil(np.maximum(linear, np.abs(velocities[:, 2]) * seconds / radians)))
    dt = (seconds / counts)[:, None]
    number = np.arange(1, math.ceil(counts.max()) + 1)
    passed = np.minimum(number, counts[:, None]) * dt
    lasts = np.where(number <= counts[:, None], dt, 0.0)
    vx, vy, wz = (
        _changing(start, target, up * passed, down * passed)
        for start, target, up, down in zip(
            now, velocities.T, kinematics.acceleration, kinematics.deceleration, strict=True
        )
    )
    turned = np.cumsum(wz * lasts, axis=1)
    yaw = pose.yaw + np.concatenate((np.zeros_like(dt), turned), axis=1)
    cosine, sine = np.cos(yaw[:, :-1]) * lasts, np.sin(yaw[:, :-1]) * lasts
    dx, dy = vx * cosine, vx * sine
    if vy.any():
        dx, dy = dx - vy * sine, dy + vy * cosine
    poses = np.empty((*yaw.shape, 3))
    poses[:, 0, :2], poses[..., 2] = (pose.x, pose.y), yaw
    poses[:, 1:, 0], poses[:, 1:, 1] = pose.x + np.cumsum(dx, axis=1), pose.y + np.cumsum(dy, axis=1)
    return poses


def _changing(start: float, target: Array, up: Array, down: Array) -> Array:
    """The velocities (n, steps) on the way from `start` to the targets (n,), after changes of at most so much."""
    if start == 0.0 and not target.any():
        return np.zeros((1, 1))
    goal = target[:, None]
    return np.asarray(np.where(start < goal, np.minimum(goal, start + up), np.maximum(goal, start + down)))
