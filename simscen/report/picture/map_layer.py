"""Map of the world and grid of coordinates: the background of all pictures with a map."""

import math
from functools import cache

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw

from simscen.core.environment.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array
from simscen.report.picture import palette
from simscen.report.picture.canvas import SUPERSAMPLING, Bounds, Canvas, Fill, TextItem, draw_text

MAX_MAP_SIZE_PX = (1000, 800)
"""Maximum width and height of the map on a picture."""
MARGIN_M = 0.4
"""Margin of a picture around the known cells and the required points."""


def map_extent(grid: OccupancyGrid, points: Array) -> Bounds:
    """Return the rectangle around all known cells of the map and all finite `points` (n, 2) in m, with a margin."""
    points = points[np.isfinite(points).all(axis=1)]
    rows, columns = np.nonzero(grid.cells != UNKNOWN)
    if len(rows):
        corners = np.array([(r, c) for r in (rows.min(), rows.max() + 1) for c in (columns.min(), columns.max() + 1)])
        known = grid.origin.apply(corners[:, ::-1].astype(np.float64) * grid.resolution)
        points = np.vstack((points, known))
    if not len(points):
        return -1.0, -1.0, 1.0, 1.0
    (x0, y0), (x1, y1) = points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M
    return float(x0), float(y0), float(x1), float(y1)


def map_scale(bounds: Bounds) -> float:
    """Return the largest scale in pixels per meter with which a map is at most MAX_MAP_SIZE_PX large."""
    x0, y0, x1, y1 = bounds
    return min(MAX_MAP_SIZE_PX[0] / (x1 - x0), MAX_MAP_SIZE_PX[1] / (y1 - y0))


def draw_map(canvas: Canvas, grid: OccupancyGrid) -> None:
    """Draw the map as the image of the canvas, below everything else."""
    pixel_size = 1 / (canvas.scale * SUPERSAMPLING)
    factor = max(1, int(pixel_size / grid.resolution))
    cells = _downsample(grid.cells, factor) if factor > 1 else grid.cells
    image, resolution = Image.fromarray(_colors()[cells.view(np.uint8)]), grid.resolution * factor
    x0, _, _, y1 = canvas.bounds
    corners = np.array([[x0, y1], [x0 + pixel_size, y1], [x0, y1 - pixel_size]])
    origin, right, down = grid.origin.inverse().apply(corners) / resolution
    affine = (
        *(right[0] - origin[0], down[0] - origin[0], origin[0]),
        *(right[1] - origin[1], down[1] - origin[1], origin[1]),
    )
    canvas.set_image(
        image.transform(
            canvas.supersampled_size, Image.Transform.AFFINE, tuple(map(float, affine)), fillcolor=palette.UNKNOWN
        )
    )


@cache
def _colors() -> npt.NDArray[np.uint8]:
    """Return the colors (256, 3) of the cell values, indexed by the value as an unsigned byte."""
    table = np.empty((256, 3), dtype=np.uint8)
    for value in range(256):
        occupancy = min(value, OCCUPIED) / OCCUPIED
        table[value] = [round(f + occupancy * (w - f)) for f, w in zip(palette.FREE, palette.WALL, strict=True)]
    table[np.uint8(UNKNOWN % 256)] = palette.UNKNOWN
    return table


def _downsample(cells: npt.NDArray[np.int8], factor: int) -> npt.NDArray[np.int8]:
    """Return the highest value in each block of factor x factor cells."""
    height, width = (-(-side // factor) * factor for side in cells.shape)
    padded = np.full((height, width), UNKNOWN, dtype=np.int8)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    blocks: npt.NDArray[np.int8] = padded.reshape(height // factor, factor, width // factor, factor).max(axis=(1, 3))
    return blocks


LEFT_MARGIN_PX, BOTTOM_MARGIN_PX = 40, 26
"""Space for the coordinates to the left of the map and below it."""
_MIN_GRID_SPACING_PX = 55
"""Minimum distance between two grid lines."""


def grid_spacing(canvas: Canvas) -> float:
    """Return the distance between grid lines in m.

    The distance is 1, 2, or 5 times a power of ten, and at least _MIN_GRID_SPACING_PX on the canvas.
    """
    min_spacing = _MIN_GRID_SPACING_PX / canvas.scale
    power = 10.0 ** math.floor(math.log10(min_spacing))
    return next(power * factor for factor in (1, 2, 5, 10) if power * factor >= min_spacing)


def grid_coordinates(low: float, high: float, step: float) -> list[float]:
    """Return the multiples of `step` from `low` to `high`."""
    return [round(k * step, 6) for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def draw_grid(canvas: Canvas, step: float, color: Fill) -> None:
    """Draw faint lines at the multiples of `step` in m."""
    x0, y0, x1, y1 = canvas.bounds
    for x in grid_coordinates(x0, x1, step):
        canvas.line(np.array([(x, y0), (x, y1)]), color, 0.5)
    for y in grid_coordinates(y0, y1, step):
        canvas.line(np.array([(x0, y), (x1, y)]), color, 0.5)
    canvas.add_part(f"grid every {step:g} m", [(x0, y0), (x1, y1)])


def write_coordinates(pen: ImageDraw.ImageDraw, canvas: Canvas, left: float, top: float) -> None:
    """Write the coordinates of the grid lines next to the map, whose upper left corner is at pixel (left, top)."""
    x0, y0, x1, y1 = canvas.bounds
    step = grid_spacing(canvas)
    for x in grid_coordinates(x0, x1, step):
        u = left + canvas.pixel(x, y0)[0]
        draw_text(pen, TextItem(u, top + canvas.height + 12, f"{x:g}", 11, palette.FAINT_INK, "mm"))
    for y in grid_coordinates(y0, y1, step):
        v = top + canvas.pixel(x0, y)[1]
        draw_text(pen, TextItem(left - 7, v, f"{y:g}", 11, palette.FAINT_INK, "rm"))
    draw_text(pen, TextItem(left - 7, top + canvas.height + 12, "x, y in m", 10, palette.FAINT_INK, "mm"))
