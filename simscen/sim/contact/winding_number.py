"""Whether a place is inside something solid that the engine knows as a surface only.

Bullet's concave meshes are shells: what is wholly inside touches nothing. A closed surface, however concave, winds once
around every place inside it and not at all around the others.
"""

import math

import numpy as np

from simscen.core.geometry import Array

Vector = tuple[float, float, float]
TILT = 0.0123, 0.0271
"""m by which the line through a place leans towards x and y for each m of its height: edges of maps lie upright."""


def encloses(corners: Array, place: Vector) -> bool:
    """Whether triangles (n, 3, 3), anticlockwise from outside, enclose a place.

    Sums up their solid angles (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983); small holes do no harm.
    """
    ax, ay, az, bx, by, bz, cx, cy, cz = np.ascontiguousarray(corners.reshape(-1, 9).T) - np.tile(place, 3)[:, None]
    la, lb, lc = (np.sqrt(x * x + y * y + z * z) for x, y, z in ((ax, ay, az), (bx, by, bz), (cx, cy, cz)))
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
    angles = 2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return bool(angles.sum() > 2 * math.pi)


def encloses_along_line(corners: Array, place: Vector) -> bool | None:
    """`winds_around`, told by those triangles (n, 3, 3) of a surface alone that a line through the place may meet.

    Whoever goes to infinity leaves a closed surface so often more than it enters it as it winds around the place. None
    where both ways along the line do not say the same, as through a hole, or where an edge lies on it.
    """
    x, y, z = np.moveaxis(corners - place, 2, 0)
    x, y = x - TILT[0] * z, y - TILT[1] * z
    # For each corner, twice the area that the line and the two others span: all are of one sign where it passes.
    areas = np.roll(x, -1, 1) * np.roll(y, -2, 1) - np.roll(x, -2, 1) * np.roll(y, -1, 1)
    passes = (areas >= 0).all(axis=1) | (areas <= 0).all(axis=1)
    areas, z = areas[passes], z[passes]
    if not areas.all():
        return None
    facing, above = np.sign(areas[:, 0]), (areas * z).sum(axis=1) * areas[:, 0] > 0
    up, down = facing[above].sum(), -facing[~above].sum()
    return bool(up > 0) if up == down else None
