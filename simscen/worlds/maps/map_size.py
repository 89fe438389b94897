"""How large the map of a world is, in plain numbers, so that `validate` can tell without drawing it."""

import math
from typing import NamedTuple

MARGIN = 1.0
"""Meters of map around everything there is, so that a robot outside of the last wall is still on the map."""
MOST_CELLS = 16_000_000
"""Of a map that is drawn: 200 x 200 m at 5 cm."""
RESOLUTION = 0.05
"""Meters of a cell of the robot's map, as is usual with SLAM."""

Bounds = tuple[float, float, float, float]
"""min x, min y, max x, max y in meters."""


class MapSize(NamedTuple):
    """First column and row as multiples of the resolution, and how many there are."""

    left: int
    bottom: int
    width: int
    height: int


def map_size(bounds: Bounds, resolution: float = RESOLUTION) -> MapSize:
    """The cells over `bounds` and MARGIN; the lines of the map are multiples of `resolution` in meters."""
    left, bottom = (math.floor(round((edge - MARGIN) / resolution, 6)) for edge in bounds[:2])
    right, top = (math.ceil(round((edge + MARGIN) / resolution, 6)) for edge in bounds[2:])
    return MapSize(left, bottom, right - left, top - bottom)


def too_large(bounds: Bounds, resolution: float = RESOLUTION) -> str | None:
    """Why no map can be drawn over `bounds`."""
    size = map_size(bounds, resolution)
    if size.width * size.height <= MOST_CELLS:
        return None
    return f"map too large: {size.width} x {size.height} cells of {resolution:g} m, more than {MOST_CELLS} cells"
