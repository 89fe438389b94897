"""Whether a place is inside something solid that the engine knows as a surface only.

Bullet's concave meshes are shells: what is wholly inside touches nothing. A closed surface, however concave, winds once
around every place inside it and not at all around the others.
"""

import math

import numpy as np

from simscen.core.geometry import Array

Vector = tuple[float, float, float]


def winds_around(corners: Array, place: Vector) -> bool:
    """Whether triangles (n, 3, 3), anticlockwise from outside, enclose a place.

    Sums up their solid angles (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983); small holes do no harm.
    """
    ax, ay, az, bx, by, bz, cx, cy, cz = np.ascontiguousarray(corners.reshape(-1, 9).T) - np.tile(place, 3)[:, None]
    la, lb, lc = (np.sqrt(x * x + y * y + z * z) for x, y, z in ((ax, ay, az), (bx, by, bz), (cx, cy, cz)))
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
    angles = 2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return bool(angles.sum() > 2 * math.pi)
