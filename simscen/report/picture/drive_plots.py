"""What a robot drove: each trial in a panel, as it was commanded, reckoned and in truth."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Array, Pose2
from simscen.report.picture import map_layer, palette
from simscen.report.picture.canvas import Canvas, TextItem, printable
from simscen.report.picture.map_picture import MAX_MAP_SIZE_PX
from simscen.report.picture.palette import AMBER, FAINT_INK, GREEN, INK, PAGE, ROBOT, RULE

DriveTrial = tuple[str, Sequence[Pose2], Sequence[Pose2], Sequence[Pose2]]
PANEL_SIZE_PX, PANEL_MARGIN_M = 420, 0.25
"""Pixels of a panel's side; m around what is drawn."""
GRID_SPACING_M = 0.5
"""m between two lines of the grid."""


def draw_drives(title: str, trials: Sequence[DriveTrial], footprint: Polygon) -> Image.Image:
    """Panels side by side: name, then commanded (dashed), by odometry (amber) and true way (green), from the origin."""
    panels = [_panel(title, trial, np.array(footprint)) for trial in trials]
    image = Image.new("RGB", (PANEL_SIZE_PX * len(panels), PANEL_SIZE_PX), PAGE)
    for k, panel in enumerate(panels):
        image.paste(panel, (k * PANEL_SIZE_PX, 0))
    return image


def _panel(
    title: str, trial: DriveTrial, footprint: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]"
) -> Image.Image:
    name, *ways = trial
    drawn = [end.apply(footprint) for end in (ways[2][0], ways[2][-1])]
    points = np.concatenate([*drawn, *(_points(way) for way in ways)])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = float(np.ptp(points, axis=0).max()) / 2 + PANEL_MARGIN_M
    x, y = middle.tolist()
    canvas = Canvas((x - half, y - half, x + half, y + half), PANEL_SIZE_PX / (2 * half), PAGE)
    for at in (
        np.arange(np.floor((x - half) / GRID_SPACING_M), np.ceil((x + half) / GRID_SPACING_M) + 1) * GRID_SPACING_M
    ):
        canvas.line(np.array([(at, y - half), (at, y + half)]), RULE, 0.5)
    for at in (
        np.arange(np.floor((y - half) / GRID_SPACING_M), np.ceil((y + half) / GRID_SPACING_M) + 1) * GRID_SPACING_M
    ):
        canvas.line(np.array([(x - half, at), (x + half, at)]), RULE, 0.5)
    for corners in drawn:
        canvas.polygon(corners, None, ROBOT, 1.0)
    canvas.line(_points(ways[2]), GREEN, 3.0)
    canvas.line(_points(ways[1]), AMBER, 1.5)
    canvas.dashes(_points(ways[0]), INK, 1.0)
    canvas.note(TextItem(10, 16, printable(f"{title}: {name}"), 15, INK))
    for k, (text, color) in enumerate((("commanded (dashed)", INK), ("odometry", AMBER), ("true", GREEN))):
        canvas.note(TextItem(10 + (0, 150, 230)[k], PANEL_SIZE_PX - 14, text, 12, color))
    canvas.note(TextItem(PANEL_SIZE_PX - 10, 16, f"grid {GRID_SPACING_M:g} m", 12, FAINT_INK, "rm"))
    return canvas.finish().resize((PANEL_SIZE_PX, PANEL_SIZE_PX)) if canvas.width != PANEL_SIZE_PX else canvas.finish()


def _points(way: Sequence[Pose2]) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    return np.array([(pose.x, pose.y) for pose in way])


def write_localization_picture(grid: OccupancyGrid, belief: Array, reference: Array, path: Path) -> None:
    """Draw the map, the `reference` (n, 2), broad, and the `belief` (m, 2) on top of it, dashed."""
    bounds = map_layer.map_extent(grid, np.vstack((belief, reference)))
    x0, y0, x1, y1 = bounds
    canvas = Canvas(bounds, min(MAX_MAP_SIZE_PX[0] / (x1 - x0), MAX_MAP_SIZE_PX[1] / (y1 - y0)), palette.UNKNOWN)
    map_layer.draw_map(canvas, grid)
    canvas.line(reference, palette.PLAN, 5.0)
    canvas.dashes(belief, palette.RED, 2.0)
    for row, (text, color) in enumerate((("belief", palette.RED), ("reference", palette.PLAN))):
        if row == 0 or len(reference):
            canvas.note(TextItem(12, 16 + 18 * row, text, 13, color, halo=palette.INK if row else None))
    canvas.finish().save(path, format="PNG", compress_level=3)
