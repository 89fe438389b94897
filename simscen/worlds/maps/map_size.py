"""Compute the size of the occupancy map of a world before it is drawn, without importing NumPy."""

import math
from typing import NamedTuple

MAP_MARGIN_M = 1.0
"""Width of the border of a map around the bounds of the world."""
MAX_MAP_CELLS = 16_000_000
"""Maximum number of cells of a map: 200 x 200 m at 5 cm."""
MAP_RESOLUTION_M = 0.05
"""Default edge length of a cell."""

Bounds = tuple[float, float, float, float]
"""Rectangle (min x, min y, max x, max y) in meters."""


class MapSize(NamedTuple):
    """Position and size of a map in cells: its lower left corner is at (`left`, `bottom`) times the resolution."""

    left: int
    bottom: int
    width: int
    """Number of columns."""
    height: int
    """Number of rows."""


def map_size(bounds: Bounds, resolution: float) -> MapSize:
    """Return the size of a map that covers `bounds` and MAP_MARGIN_M around it, with cells of `resolution` m."""
    left, bottom = (math.floor(round((edge - MAP_MARGIN_M) / resolution, 6)) for edge in bounds[:2])
    right, top = (math.ceil(round((edge + MAP_MARGIN_M) / resolution, 6)) for edge in bounds[2:])
    return MapSize(left, bottom, right - left, top - bottom)


def map_size_error(bounds: Bounds, resolution: float = MAP_RESOLUTION_M) -> str | None:
    """Return a message if a map over `bounds` with cells of `resolution` m is too large, otherwise None."""
    size = map_size(bounds, resolution)
    if size.width * size.height <= MAX_MAP_CELLS:
        return None
    return f"map too large: {size.width} x {size.height} cells of {resolution:g} m, more than {MAX_MAP_CELLS} cells"


def fitting_resolution(bounds: Bounds) -> float:
    """Return the default resolution in m, doubled until a map over `bounds` is not too large."""
    resolution = MAP_RESOLUTION_M
    while map_size_error(bounds, resolution):
        resolution *= 2
    return resolution
