"""A picture of where a localizer believed the robot to be, over the map and a reference."""

from pathlib import Path

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array
from simscen.report.picture import ground, palette
from simscen.report.picture.canvas import Canvas, Note
from simscen.report.picture.compose import LARGEST


def write_localized(grid: OccupancyGrid, belief: Array, reference: Array, path: Path) -> None:
    """Draw the map, the `reference` (n, 2), broad, and the `belief` (m, 2) on top of it, dashed."""
    bounds = ground.extent(grid, np.vstack((belief, reference)))
    x0, y0, x1, y1 = bounds
    canvas = Canvas(bounds, min(LARGEST[0] / (x1 - x0), LARGEST[1] / (y1 - y0)), palette.UNKNOWN)
    ground.lay(canvas, grid)
    canvas.line(reference, palette.PLAN, 5.0)
    canvas.dashes(belief, palette.RED, 2.0)
    for row, (text, color) in enumerate((("belief", palette.RED), ("reference", palette.PLAN))):
        if row == 0 or len(reference):
            canvas.note(Note(12, 16 + 18 * row, text, 13, color, halo=palette.INK if row else None))
    canvas.finish().save(path, format="PNG", compress_level=3)
