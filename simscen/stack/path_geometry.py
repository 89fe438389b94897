"""Motion of a base at constant velocity: arcs in closed form (Thrun et al., Probabilistic Robotics, eq. 5.9)."""

import cmath
import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.geometry.kinematics import Twist

MIN_YAW_RATE = 1e-6
"""rad/s below which an arc is a straight line."""
LOCAL_PLAN_TIMES_S = tuple(0.25 * step for step in range(7))
"""Times of the poses in a logged local plan. At 0.5 m/s and 1 rad/s, the chords are at most 4 mm off the arc."""


def poses_along(pose: Pose2, twist: Twist, times: Array) -> Array:
    """Return the poses (n, 3) of a base that starts at `pose` with constant `twist`, after `times` (n,) in s."""
    vx, vy, wz = twist
    turned = wz * times
    if abs(wz) < MIN_YAW_RATE:
        x, y = vx * times, vy * times
    else:
        forward, left = np.sin(turned) / wz, (1.0 - np.cos(turned)) / wz
        x, y = (vx * forward, vx * left) if vy == 0.0 else (vx * forward - vy * left, vx * left + vy * forward)
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    poses = np.empty((len(times), 3))
    poses[:, 0], poses[:, 1], poses[:, 2] = pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y, turned
    poses[:, 2] += pose.yaw
    return poses


def arc_poses(pose: Pose2, twist: Twist, times: Iterable[float]) -> Array:
    """Return the same poses (n, 3), computed with scalars: faster than with arrays for about a dozen times."""
    (x, y, yaw), (vx, vy, wz) = pose, twist
    start, velocity = complex(x, y), cmath.rect(1.0, yaw) * complex(vx, vy)
    poses: list[tuple[float, float, float]] = []
    for time in times:
        turned = wz * time
        effective_time = time if abs(wz) < MIN_YAW_RATE else (cmath.rect(1.0, turned) - 1.0) / complex(0.0, wz)
        position = start + velocity * effective_time
        poses.append((position.real, position.imag, wrap(yaw + turned)))
    return np.array(poses)


def forward_steps(poses: Array) -> npt.NDArray[np.bool_]:
    """Return for each step (n - 1,) between poses (n, 3) whether it points forward in the robot's heading."""
    steps = np.diff(poses[:, :2], axis=0)
    forward: npt.NDArray[np.bool_] = steps[:, 0] * np.cos(poses[:-1, 2]) + steps[:, 1] * np.sin(poses[:-1, 2]) >= -1e-9
    return forward


def direction_changes(forward: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Return the indices of the poses between a forward and a backward step."""
    return np.flatnonzero(forward[1:] != forward[:-1]) + 1


def cusps(poses: Array) -> npt.NDArray[np.int64]:
    """Return the indices of the cusps among the poses (n, 3)."""
    return direction_changes(forward_steps(poses))
