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
    a, b, c = (corners - place).swapaxes(0, 1)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = (np.einsum("ij,ij->i", p, q) for p, q in ((a, b), (b, c), (c, a)))
    ab, bc, ca = dots
    angles = 2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return bool(angles.sum() > 2 * math.pi)
