"""How the uncertainty of a planar pose grows along a step of dead reckoning, to first order.

Probabilistic Robotics, section 5.4; errors of a step are independent, so that variances add up along the way.
"""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2


def swing(covariance: Array, dx: float, dy: float) -> Array:
    """A covariance (3, 3) after an exact move by (dx, dy) in the map frame: an uncertain heading swings the place."""
    (xx, xy, xa), (_, yy, ya), (_, _, aa) = covariance.tolist()
    xa_swung, ya_swung = xa - dy * aa, ya + dx * aa
    xy_swung = xy + dx * xa - dy * ya_swung
    return np.array([
        [xx - dy * (xa + xa_swung), xy_swung, xa_swung],
        [xy_swung, yy + dx * (ya + ya_swung), ya_swung],
        [xa_swung, ya_swung, aa],
    ])  # fmt: skip


def grown(covariance: Array, yaw: float, step: Pose2, translation_noise: float, rotation_noise: float) -> Array:
    """A covariance (3, 3) after `step` in the base frame, taken at heading `yaw`.

    `translation_noise` is the standard deviation in m along the way after one metre, `rotation_noise` that of the
    heading in rad after one metre or one rad.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy, length = c * step.x - s * step.y, s * step.x + c * step.y, math.hypot(step.x, step.y)
    along = translation_noise**2 / length if length > 0 else 0.0
    noise = np.diag([0.0, 0.0, rotation_noise**2 * (length + abs(step.yaw))])
    noise[:2, :2] = along * np.outer((dx, dy), (dx, dy))
    return swing(covariance, dx, dy) + noise
