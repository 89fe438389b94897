"""Pictures of test drives for `simscen robot`, and of estimated and reference paths on a map for `simscen localize`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Array, Pose2
from simscen.report.picture import map_picture, palette
from simscen.report.picture.canvas import Canvas, TextItem, printable
from simscen.report.picture.map_picture import MAX_MAP_SIZE_PX
from simscen.report.picture.palette import AMBER, FAINT_INK, GREEN, INK, PAGE, ROBOT, RULE

DriveTrial = tuple[str, Sequence[Pose2], Sequence[Pose2], Sequence[Pose2]]
"""Name of a test drive, and three paths: as commanded, as estimated by odometry, and the true one."""
PANEL_SIZE_PX, PANEL_MARGIN_M = 420, 0.25
GRID_SPACING_M = 0.5


def draw_drives(title: str, trials: Sequence[DriveTrial], footprint: Polygon) -> Image.Image:
    """Draw panels with the commanded (dashed), estimated (amber) and true path (green), which start at the origin."""
    panels = [_panel(title, trial, np.array(footprint)) for trial in trials]
    image = Image.new("RGB", (PANEL_SIZE_PX * len(panels), PANEL_SIZE_PX), PAGE)
    for k, panel in enumerate(panels):
        image.paste(panel, (k * PANEL_SIZE_PX, 0))
    return image


def _panel(
    title: str, trial: DriveTrial, footprint: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]"
) -> Image.Image:
    name, *paths = trial
    footprints = [end.apply(footprint) for end in (paths[2][0], paths[2][-1])]
    points = np.concatenate([*footprints, *(_points(path) for path in paths)])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = float(np.ptp(points, axis=0).max()) / 2 + PANEL_MARGIN_M
    x, y = middle.tolist()
    canvas = Canvas((x - half, y - half, x + half, y + half), PANEL_SIZE_PX / (2 * half), PAGE)
    for line in map_picture.grid_coordinates(x - half, x + half, GRID_SPACING_M):
        canvas.line(np.array([(line, y - half), (line, y + half)]), RULE, 0.5)
    for line in map_picture.grid_coordinates(y - half, y + half, GRID_SPACING_M):
        canvas.line(np.array([(x - half, line), (x + half, line)]), RULE, 0.5)
    for corners in footprints:
        canvas.polygon(corners, None, ROBOT, 1.0)
    canvas.line(_points(paths[2]), GREEN, 3.0)
    canvas.line(_points(paths[1]), AMBER, 1.5)
    canvas.dashes(_points(paths[0]), INK, 1.0)
    canvas.text(TextItem(10, 16, printable(f"{title}: {name}"), 15, INK))
    for k, (text, color) in enumerate((("commanded (dashed)", INK), ("odometry", AMBER), ("true", GREEN))):
        canvas.text(TextItem(10 + (0, 150, 230)[k], PANEL_SIZE_PX - 14, text, 12, color))
    canvas.text(TextItem(PANEL_SIZE_PX - 10, 16, f"grid {GRID_SPACING_M:g} m", 12, FAINT_INK, "rm"))
    return canvas.finish().resize((PANEL_SIZE_PX, PANEL_SIZE_PX)) if canvas.width != PANEL_SIZE_PX else canvas.finish()


def _points(path: Sequence[Pose2]) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    return np.array([(pose.x, pose.y) for pose in path])


def write_localization_picture(grid: OccupancyGrid, belief: Array, reference: Array, path: Path) -> None:
    """Draw the map with the `reference` (n, 2) as a wide line and the `belief` (m, 2) as a dashed line."""
    bounds = map_picture.map_extent(grid, np.vstack((belief, reference)))
    x0, y0, x1, y1 = bounds
    canvas = Canvas(bounds, min(MAX_MAP_SIZE_PX[0] / (x1 - x0), MAX_MAP_SIZE_PX[1] / (y1 - y0)), palette.UNKNOWN)
    map_picture.draw_map(canvas, grid)
    canvas.line(reference, palette.PLAN, 5.0)
    canvas.dashes(belief, palette.RED, 2.0)
    for row, (text, color) in enumerate((("belief", palette.RED), ("reference", palette.PLAN))):
        if row == 0 or len(reference):
            canvas.text(TextItem(12, 16 + 18 * row, text, 13, color, halo=palette.INK if row else None))
    canvas.finish().save(path, format="PNG", compress_level=3)
