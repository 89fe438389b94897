"""Growth of the covariance of a planar pose along a step of dead reckoning, to first order.

Source: Probabilistic Robotics, section 5.4. The errors of steps are independent, so their covariances add up. The
functions compute with floats, because numpy is slower for nine numbers.
"""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2

Noise = tuple[float, float, float, float, float, float]
"""The upper triangle of a covariance by rows: xx, xy, xa, yy, ya, aa (a: heading)."""


def propagate_covariance(covariance: Array, dx: float, dy: float, noise: Noise) -> Array:
    """Return the covariance (3, 3) after a motion by (dx, dy) in the map frame with this noise.

    An error of the heading before the motion becomes an error of the position after it.
    """
    (xx, xy, xa), (_, yy, ya), (_, _, aa) = covariance.tolist()
    xx_new, xy_new, xa_new, yy_new, ya_new, aa_new = noise
    xa_moved, ya_moved = xa - dy * aa, ya + dx * aa
    xx_new += xx - dy * (xa + xa_moved)
    xy_new += xy + dx * xa - dy * ya_moved
    yy_new += yy + dx * (ya + ya_moved)
    xa_new, ya_new = xa_new + xa_moved, ya_new + ya_moved
    return np.array(((xx_new, xy_new, xa_new), (xy_new, yy_new, ya_new), (xa_new, ya_new, aa_new + aa)))


def rotation_matrix(yaw: float) -> Array:
    """Return the matrix (3, 3) that rotates errors from a frame at heading `yaw` to its parent frame."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def rotate_covariance(covariance: Array, yaw: float) -> Noise:
    """Return a covariance (3, 3) of a frame at heading `yaw` in its parent frame, as an upper triangle."""
    c, s = math.cos(yaw), math.sin(yaw)
    (xx, xy, xa), (_, yy, ya), (_, _, aa) = covariance.tolist()
    return (
        c * c * xx - 2 * c * s * xy + s * s * yy, c * s * (xx - yy) + (c * c - s * s) * xy, c * xa - s * ya,
        s * s * xx + 2 * c * s * xy + c * c * yy, s * xa + c * ya, aa,
    )  # fmt: skip


def grow_covariance(
    covariance: Array, yaw: float, step: Pose2, translation_noise: float, rotation_noise: float
) -> Array:
    """Return the covariance (3, 3) after `step` in the base frame, which starts at heading `yaw`.

    `translation_noise` is the standard deviation along the path in m after one meter, `rotation_noise` that of the
    heading in rad after one meter or one rad.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy, length = c * step.x - s * step.y, s * step.x + c * step.y, math.hypot(step.x, step.y)
    along = translation_noise**2 / length if length > 0 else 0.0
    heading = rotation_noise**2 * (length + abs(step.yaw))
    noise = along * dx**2, along * dx * dy, 0.0, along * dy**2, 0.0, heading
    return propagate_covariance(covariance, dx, dy, noise)
