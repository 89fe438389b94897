"""Ways as points that straight legs join."""

import math

import numpy as np

from simscen.core.geometry import Array


def resampled(way: Array, spacing: float, least: int = 1) -> Array:
    """The way (n, 2) with points evenly spaced, at most `spacing` meters apart, in at least so many legs."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
    wanted = np.linspace(0.0, along[-1], max(least, math.ceil(along[-1] / spacing)) + 1)
    return np.column_stack((np.interp(wanted, along, way[:, 0]), np.interp(wanted, along, way[:, 1])))
