"""How the uncertainty of a planar pose grows along a step of dead reckoning, to first order.

Probabilistic Robotics, section 5.4; errors of a step are independent, so that variances add up along the way.
"""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2

Noise = tuple[float, float, float, float, float, float]
"""The upper triangle of a covariance by rows: xx, xy, xa, yy, ya, aa."""


def swing(covariance: Array, dx: float, dy: float, noise: Noise) -> Array:
    """A covariance (3, 3) after a move by (dx, dy) in the map frame: an uncertain heading swings the place.

    `noise` is what the move itself adds. In floats: nine numbers are too few for arrays.
    """
    (xx, xy, xa), (_, yy, ya), (_, _, aa) = covariance.tolist()
    xx_new, xy_new, xa_new, yy_new, ya_new, aa_new = noise
    xa_swung, ya_swung = xa - dy * aa, ya + dx * aa
    xx_new += xx - dy * (xa + xa_swung)
    xy_new += xy + dx * xa - dy * ya_swung
    yy_new += yy + dx * (ya + ya_swung)
    xa_new, ya_new = xa_new + xa_swung, ya_new + ya_swung
    return np.array(((xx_new, xy_new, xa_new), (xy_new, yy_new, ya_new), (xa_new, ya_new, aa_new + aa)))


def turn(yaw: float) -> Array:
    """The matrix (3, 3) that turns errors (x, y, yaw) of a frame at heading `yaw` into those of its parent."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def turned(covariance: Array, yaw: float) -> Noise:
    """A covariance (3, 3) of a frame at heading `yaw`, in its parent's: for `swing`, and in floats as that."""
    c, s = math.cos(yaw), math.sin(yaw)
    (xx, xy, xa), (_, yy, ya), (_, _, aa) = covariance.tolist()
    return (
        c * c * xx - 2 * c * s * xy + s * s * yy, c * s * (xx - yy) + (c * c - s * s) * xy, c * xa - s * ya,
        s * s * xx + 2 * c * s * xy + c * c * yy, s * xa + c * ya, aa,
    )  # fmt: skip


def grown(covariance: Array, yaw: float, step: Pose2, translation_noise: float, rotation_noise: float) -> Array:
    """A covariance (3, 3) after `step` in the base frame, taken at heading `yaw`.

    `translation_noise` is the standard deviation in m along the way after one meter, `rotation_noise` that of the
    heading in rad after one meter or one rad.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy, length = c * step.x - s * step.y, s * step.x + c * step.y, math.hypot(step.x, step.y)
    along = translation_noise**2 / length if length > 0 else 0.0
    turned = rotation_noise**2 * (length + abs(step.yaw))
    return swing(covariance, dx, dy, (along * dx**2, along * dx * dy, 0.0, along * dy**2, 0.0, turned))
