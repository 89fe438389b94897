"""Pictures of paths: the test drives of `simscen robot`, and the estimated path of `simscen localize` on a map."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Polygon, Pose2
from simscen.report.picture import map_layer, palette
from simscen.report.picture.canvas import Canvas, TextItem, printable
from simscen.report.picture.palette import AMBER, FAINT_INK, GREEN, INK, PAGE, ROBOT, RULE

DrivePaths = tuple[str, Sequence[Pose2], Sequence[Pose2], Sequence[Pose2]]
"""Name of a test drive, and three paths: commanded, estimated by odometry, and true."""
PANEL_SIZE_PX, PANEL_MARGIN_M = 420, 0.25
"""Width and height of a panel, and minimum distance of paths from its edges."""
GRID_SPACING_M = 0.5
"""Distance of the grid lines in a panel."""


def draw_drives(title: str, drives: Sequence[DrivePaths], footprint: Polygon) -> Image.Image:
    """Draw a panel for each test drive, from left to right.

    A panel shows the commanded path (dashed), the path estimated by odometry (amber), the true path (green), and the
    footprint of the robot at the start and at the end.
    """
    panels = [_panel(title, drive, np.array(footprint)) for drive in drives]
    image = Image.new("RGB", (PANEL_SIZE_PX * len(panels), PANEL_SIZE_PX), PAGE)
    for k, panel in enumerate(panels):
        image.paste(panel, (k * PANEL_SIZE_PX, 0))
    return image


def _panel(title: str, drive: DrivePaths, footprint: Array) -> Image.Image:
    """Draw the panel of one test drive. `footprint` are the corners (n, 2) in m."""
    name, *paths = drive
    footprints = [end.apply(footprint) for end in (paths[2][0], paths[2][-1])]
    points = np.concatenate([*footprints, *(_points(path) for path in paths)])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = float(np.ptp(points, axis=0).max()) / 2 + PANEL_MARGIN_M
    x, y = middle.tolist()
    canvas = Canvas((x - half, y - half, x + half, y + half), PANEL_SIZE_PX / (2 * half), PAGE)
    map_layer.draw_grid(canvas, GRID_SPACING_M, RULE)
    for corners in footprints:
        canvas.polygon(corners, None, ROBOT, 1.0)
    canvas.line(_points(paths[2]), GREEN, 3.0)
    canvas.line(_points(paths[1]), AMBER, 1.5)
    canvas.dashes(_points(paths[0]), INK, 1.0)
    canvas.texts.append(TextItem(10, 16, printable(f"{title}: {name}"), 15, INK))
    for k, (text, color) in enumerate((("commanded (dashed)", INK), ("odometry", AMBER), ("true", GREEN))):
        canvas.texts.append(TextItem(10 + (0, 150, 230)[k], PANEL_SIZE_PX - 14, text, 12, color))
    canvas.texts.append(TextItem(PANEL_SIZE_PX - 10, 16, f"grid {GRID_SPACING_M:g} m", 12, FAINT_INK, "rm"))
    return canvas.finish().resize((PANEL_SIZE_PX, PANEL_SIZE_PX)) if canvas.width != PANEL_SIZE_PX else canvas.finish()


def _points(path: Sequence[Pose2]) -> Array:
    return np.array([(pose.x, pose.y) for pose in path])


def write_localization_picture(grid: OccupancyGrid, belief: Array, reference: Array, path: Path) -> None:
    """Draw two paths on a map, and save the picture as PNG at `path`.

    `reference` (n, 2) is drawn as a wide line, `belief` (m, 2) as a dashed line. Positions are in m in the map frame.
    `reference` can be empty.
    """
    bounds = map_layer.map_extent(grid, np.vstack((belief, reference)))
    canvas = Canvas(bounds, map_layer.map_scale(bounds), palette.UNKNOWN)
    map_layer.draw_map(canvas, grid)
    canvas.line(reference, palette.PLAN, 5.0)
    canvas.dashes(belief, palette.RED, 2.0)
    for row, (text, color) in enumerate((("belief", palette.RED), ("reference", palette.PLAN))):
        if row == 0 or len(reference):
            canvas.texts.append(TextItem(12, 16 + 18 * row, text, 13, color, halo=palette.INK if row else None))
    canvas.finish().save(path, format="PNG", compress_level=3)
