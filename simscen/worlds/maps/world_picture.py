"""A picture of a world from above: its cut at lidar height, the map over it, bodies, places and regions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.environment.occupancy_grid import FREE, OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld, Polygon
from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Body
from simscen.worlds.geometry.cross_section import outlines
from simscen.worlds.geometry.triangulation import fuse

if TYPE_CHECKING:
    from PIL import Image, ImageDraw

Color = tuple[int, int, int, int]

PAPER, FREE_GROUND, UNKNOWN_GROUND = (226, 230, 236, 255), (255, 255, 255, 255), (226, 230, 236, 255)
MAPPED_WALL, WALL = (147, 178, 214, 255), (16, 42, 82, 255)
BODY, PLACE, REGION, RULER = (214, 102, 20, 255), (20, 128, 74, 255), (122, 82, 178, 255), (120, 128, 140, 255)
MARK = (200, 24, 40, 255)

LONGEST = 1200
"""Pixels along the longer side."""
FINER = 2
"""Everything is drawn this much larger and scaled down, which smooths the lines."""
RING = 18 * FINER
"""Canvas pixels from the middle of a gap to the ring around it."""


@dataclass(frozen=True)
class View:
    """Where world points land on the canvas: `left`, `top` in meters, `scale` in canvas pixels per meter."""

    left: float
    top: float
    scale: float
    size: tuple[int, int]

    def pixels(self, points: Array) -> list[tuple[float, float]]:
        """Canvas positions of world points (n, 2)."""
        x, y = (points[:, 0] - self.left) * self.scale, (self.top - points[:, 1]) * self.scale
        return list(zip(x.tolist(), y.tolist(), strict=True))


def picture(
    built: BuiltWorld,
    height: float,
    footprints: Sequence[Polygon] = (),
    gaps: Sequence[tuple[float, float]] = (),
) -> "Image.Image":
    """The world cut at `height` meters, as an RGB image of at most LONGEST pixels a side, north (y) up.

    Dark lines are the cut, light blue cells the map over it, gray what the map does not know; bodies are orange where
    they start, places green, regions violet. `footprints` are drawn in red, and red rings around `gaps`.
    """
    from PIL import Image, ImageDraw

    view = _view(built.map)
    canvas = Image.new("RGBA", view.size, PAPER)
    canvas.alpha_composite(_map_layer(built.map, view))
    overlay = Image.new("RGBA", view.size, (0, 0, 0, 0))
    pen = ImageDraw.Draw(overlay)
    for polygon in built.world.regions.values():
        pen.polygon(view.pixels(np.array(polygon)), fill=(*REGION[:3], 40), outline=REGION, width=FINER)
    _lines(pen, view, outlines(built.mesh, height), WALL)
    for body in built.world.bodies:
        _lines(pen, view, _body_outline(body, height), BODY)
    for outline in footprints:
        pen.polygon(view.pixels(np.array(outline)), fill=(*MARK[:3], 60), outline=MARK, width=FINER + 1)
    _names(pen, view, built)
    for x, y in view.pixels(np.array(gaps).reshape(-1, 2)):
        pen.ellipse((x - RING, y - RING, x + RING, y + RING), outline=MARK, width=2 * FINER)
    _ruler(pen, view)
    canvas.alpha_composite(overlay)
    width, rows = view.size
    return canvas.convert("RGB").resize((width // FINER, rows // FINER), Image.Resampling.LANCZOS)


def _view(grid: OccupancyGrid) -> View:
    corners = grid.origin.apply(_corners(grid))
    (left, low), (right, top) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    scale = FINER * LONGEST / max(right - left, top - low)
    size = (max(FINER, math.ceil((right - left) * scale)), max(FINER, math.ceil((top - low) * scale)))
    return View(left, top, scale, size)


def _corners(grid: OccupancyGrid) -> Array:
    height, width = (cells * grid.resolution for cells in grid.shape)
    return np.array([[0, 0], [width, 0], [width, height], [0, height]])


def _map_layer(grid: OccupancyGrid, view: View) -> "Image.Image":
    """The map's cells, turned by the yaw of its origin."""
    from PIL import Image

    shades = np.array([UNKNOWN_GROUND, FREE_GROUND, MAPPED_WALL], dtype=np.uint8)
    kind = np.where(grid.cells < 0, 0, np.where(grid.cells == FREE, 1, 2))
    cells = Image.fromarray(shades[kind], "RGBA")
    # Pillow wants the cell for a pixel: canvas -> world -> the grid's own frame -> cells.
    ends = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) / view.scale * (1, -1) + (view.left, view.top)
    zero, right, down = grid.origin.inverse().apply(ends) / grid.resolution
    across, along = right - zero, down - zero
    matrix = (across[0], along[0], zero[0], across[1], along[1], zero[1])
    return cells.transform(view.size, Image.Transform.AFFINE, matrix, Image.Resampling.NEAREST, fillcolor=PAPER)


def _body_outline(body: Body, height: float) -> Array:
    """The cut of a body where it starts; of one that is lower or higher than that, a cut at half its own height."""
    mesh = fuse(body.solids)
    placed = type(mesh)(body.pose.apply(mesh.vertices), mesh.faces, mesh.owners, mesh.names)
    cut = outlines(placed, height)
    if len(cut) or not len(placed.vertices):
        return cut
    low, high = placed.vertices[:, 2].min(), placed.vertices[:, 2].max()
    return outlines(placed, float(low + high) / 2)


def _lines(pen: "ImageDraw.ImageDraw", view: View, segments: Array, color: Color) -> None:
    for a, b in zip(view.pixels(segments[:, 0]), view.pixels(segments[:, 1]), strict=True):
        pen.line((a, b), fill=color, width=FINER + 1)


def _names(pen: "ImageDraw.ImageDraw", view: View, built: BuiltWorld) -> None:
    for name, polygon in built.world.regions.items():
        upper_left = np.array([[min(x for x, _ in polygon), max(y for _, y in polygon)]])
        _text(pen, view.pixels(upper_left)[0], name, REGION)
    for body in built.world.bodies:
        _text(pen, view.pixels(np.array([body.pose.position[:2]]))[0], body.name, BODY)
    for name, place in built.world.places.items():
        tip = place.apply(np.array([[0.0, 0.0], [0.3, 0.0]]))
        (x, y), end = view.pixels(tip)
        radius = 4 * FINER
        pen.line(((x, y), end), fill=PLACE, width=2 * FINER)
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=PLACE)
        _text(pen, (x, y), name, PLACE)


def _text(pen: "ImageDraw.ImageDraw", place: tuple[float, float], text: str, color: Color) -> None:
    from PIL import ImageFont

    font = ImageFont.load_default(13 * FINER)
    x, y = place[0] + 6 * FINER, place[1] + 4 * FINER
    pen.text((x, y), text, fill=color, font=font, stroke_width=FINER, stroke_fill=(255, 255, 255, 220))


def _ruler(pen: "ImageDraw.ImageDraw", view: View) -> None:
    """A scale bar in the lower left corner, about a fifth of the picture long: 1, 2 or 5 times a power of ten."""
    wanted = view.size[0] / view.scale / 5
    power = 10.0 ** math.floor(math.log10(wanted))
    meters = max(step * power for step in (1, 2, 5) if step * power <= wanted)
    x, y = 14 * FINER, view.size[1] - 14 * FINER
    pen.line((x, y, x + meters * view.scale, y), fill=RULER, width=3 * FINER)
    _text(pen, (x - 6 * FINER, y - 24 * FINER), f"{meters:g} m", RULER)
