"""What a robot drove: each trial in a panel, as it was commanded, reckoned and in truth."""

from collections.abc import Sequence

import numpy as np
from PIL import Image

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Pose2
from simscen.report.picture.canvas import Canvas, Note, shown
from simscen.report.picture.palette import AMBER, FAINT_INK, GREEN, INK, PAGE, ROBOT, RULE

Ways = tuple[str, Sequence[Pose2], Sequence[Pose2], Sequence[Pose2]]
SIZE, MARGIN = 420, 0.25
"""Pixels of a panel's side; m around what is drawn."""
GRID = 0.5
"""m between two lines of the grid."""


def draw_drives(title: str, trials: Sequence[Ways], footprint: Polygon) -> Image.Image:
    """Panels side by side: name, then commanded (dashed), by odometry (amber) and true way (green), from the origin."""
    panels = [_panel(title, trial, np.array(footprint)) for trial in trials]
    image = Image.new("RGB", (SIZE * len(panels), SIZE), PAGE)
    for k, panel in enumerate(panels):
        image.paste(panel, (k * SIZE, 0))
    return image


def _panel(title: str, trial: Ways, footprint: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]") -> Image.Image:
    name, *ways = trial
    drawn = [end.apply(footprint) for end in (ways[2][0], ways[2][-1])]
    points = np.concatenate([*drawn, *(_points(way) for way in ways)])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    half = float(np.ptp(points, axis=0).max()) / 2 + MARGIN
    x, y = middle.tolist()
    canvas = Canvas((x - half, y - half, x + half, y + half), SIZE / (2 * half), PAGE)
    for at in np.arange(np.floor((x - half) / GRID), np.ceil((x + half) / GRID) + 1) * GRID:
        canvas.line(np.array([(at, y - half), (at, y + half)]), RULE, 0.5)
    for at in np.arange(np.floor((y - half) / GRID), np.ceil((y + half) / GRID) + 1) * GRID:
        canvas.line(np.array([(x - half, at), (x + half, at)]), RULE, 0.5)
    for corners in drawn:
        canvas.polygon(corners, None, ROBOT, 1.0)
    canvas.line(_points(ways[2]), GREEN, 3.0)
    canvas.line(_points(ways[1]), AMBER, 1.5)
    canvas.dashes(_points(ways[0]), INK, 1.0)
    canvas.note(Note(10, 16, shown(f"{title}: {name}"), 15, INK))
    for k, (text, color) in enumerate((("commanded (dashed)", INK), ("odometry", AMBER), ("true", GREEN))):
        canvas.note(Note(10 + (0, 150, 230)[k], SIZE - 14, text, 12, color))
    canvas.note(Note(SIZE - 10, 16, f"grid {GRID:g} m", 12, FAINT_INK, "rm"))
    return canvas.finish().resize((SIZE, SIZE)) if canvas.width != SIZE else canvas.finish()


def _points(way: Sequence[Pose2]) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    return np.array([(pose.x, pose.y) for pose in way])
