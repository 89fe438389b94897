"""Draw a picture of a world from above: its cross section, map, bodies, places and regions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.environment.occupancy_grid import FREE, OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry import Array, Polygon
from simscen.core.geometry.shapes import Body
from simscen.worlds.geometry.cross_section import cross_section
from simscen.worlds.geometry.triangulation import merge_solids

if TYPE_CHECKING:
    from PIL import Image, ImageDraw

Color = tuple[int, int, int, int]
"""Red, green, blue and opacity, 0 to 255."""

BACKGROUND_COLOR = UNKNOWN_COLOR = (226, 230, 236, 255)
FREE_COLOR = (255, 255, 255, 255)
OCCUPIED_COLOR = (147, 178, 214, 255)
WALL_COLOR = (16, 42, 82, 255)
BODY_COLOR = (214, 102, 20, 255)
PLACE_COLOR = (20, 128, 74, 255)
REGION_COLOR = (122, 82, 178, 255)
SCALE_BAR_COLOR = (120, 128, 140, 255)
MARKER_COLOR = (200, 24, 40, 255)
"""Color of footprints and of rings around gaps."""

MAX_SIDE_PIXELS = 1200
"""Length of the longer side of the picture."""
SUPERSAMPLING = 2
"""Size of the canvas relative to the picture. The canvas is scaled down at the end, for smooth lines."""
GAP_RING_RADIUS_PIXELS = 18 * SUPERSAMPLING
"""Radius of the ring around a gap, in canvas pixels."""


@dataclass(frozen=True)
class Viewport:
    """Mapping of the world to the canvas.

    left, top:  world coordinates in m of the upper left corner of the canvas
    scale:      canvas pixels per m
    size:       width and height of the canvas in pixels
    """

    left: float
    top: float
    scale: float
    size: tuple[int, int]

    def pixels(self, points: Array) -> list[tuple[float, float]]:
        """Return the positions (x, y) on the canvas in pixels of world points (n, 2) in m."""
        x, y = (points[:, 0] - self.left) * self.scale, (self.top - points[:, 1]) * self.scale
        return list(zip(x.tolist(), y.tolist(), strict=True))


def draw_world(
    built: BuiltWorld,
    height: float,
    footprints: Sequence[Polygon] = (),
    gaps: Sequence[tuple[float, float]] = (),
) -> "Image.Image":
    """Return an RGB image of a world with y upwards, at most MAX_SIDE_PIXELS wide and tall.

    Dark lines are the cross section of the static solids at `height` m. Occupied cells of the map are light blue, and
    unknown cells gray. Bodies at their initial poses are orange, places green, and regions violet. The outlines
    `footprints` and rings around the points `gaps`, both in the world frame, are red.
    """
    from PIL import Image, ImageDraw

    view = _viewport(built.map)
    canvas = Image.new("RGBA", view.size, BACKGROUND_COLOR)
    canvas.alpha_composite(_map_layer(built.map, view))
    overlay = Image.new("RGBA", view.size, (0, 0, 0, 0))
    pen = ImageDraw.Draw(overlay)
    for polygon in built.world.regions.values():
        pen.polygon(
            view.pixels(np.array(polygon)), fill=(*REGION_COLOR[:3], 40), outline=REGION_COLOR, width=SUPERSAMPLING
        )
    _draw_segments(pen, view, cross_section(built.mesh, height).segments, WALL_COLOR)
    for body in built.world.bodies:
        _draw_segments(pen, view, _body_outline(body, height), BODY_COLOR)
    for outline in footprints:
        pen.polygon(
            view.pixels(np.array(outline)), fill=(*MARKER_COLOR[:3], 60), outline=MARKER_COLOR, width=SUPERSAMPLING + 1
        )
    _draw_names(pen, view, built)
    for x, y in view.pixels(np.array(gaps).reshape(-1, 2)):
        radius = GAP_RING_RADIUS_PIXELS
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), outline=MARKER_COLOR, width=2 * SUPERSAMPLING)
    _draw_scale_bar(pen, view)
    canvas.alpha_composite(overlay)
    width, rows = view.size
    return canvas.convert("RGB").resize((width // SUPERSAMPLING, rows // SUPERSAMPLING), Image.Resampling.LANCZOS)


def _viewport(grid: OccupancyGrid) -> Viewport:
    xs, ys = zip(*grid.corners, strict=True)
    left, right, low, top = min(xs), max(xs), min(ys), max(ys)
    scale = SUPERSAMPLING * MAX_SIDE_PIXELS / max(right - left, top - low)
    size = (max(SUPERSAMPLING, math.ceil((right - left) * scale)), max(SUPERSAMPLING, math.ceil((top - low) * scale)))
    return Viewport(left, top, scale, size)


def _map_layer(grid: OccupancyGrid, view: Viewport) -> "Image.Image":
    """Return an image of the canvas size with the cells of the map."""
    from PIL import Image

    shades = np.array([UNKNOWN_COLOR, FREE_COLOR, OCCUPIED_COLOR], dtype=np.uint8)
    kind = np.where(grid.cells < 0, 0, np.where(grid.cells == FREE, 1, 2))
    cells = Image.fromarray(shades[kind], "RGBA")
    # Pillow needs the transform from pixels to cells: canvas -> world -> frame of the grid -> cells.
    ends = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) / view.scale * (1, -1) + (view.left, view.top)
    zero, right, down = grid.origin.inverse().apply(ends) / grid.resolution
    x_step, y_step = right - zero, down - zero
    matrix = (x_step[0], y_step[0], zero[0], x_step[1], y_step[1], zero[1])
    return cells.transform(
        view.size, Image.Transform.AFFINE, matrix, Image.Resampling.NEAREST, fillcolor=BACKGROUND_COLOR
    )


def _body_outline(body: Body, height: float) -> Array:
    """Return the segments (n, 2, 2) of the cross section of a body at its initial pose.

    The cross section is at `height` m, or at half the height of the body if it does not reach `height`.
    """
    mesh = merge_solids(body.solids)
    placed = type(mesh)(body.pose.apply(mesh.vertices), mesh.faces, mesh.owners, mesh.names)
    cut = cross_section(placed, height).segments
    if len(cut) or not len(placed.vertices):
        return cut
    low, high = placed.vertices[:, 2].min(), placed.vertices[:, 2].max()
    return cross_section(placed, float(low + high) / 2).segments


def _draw_segments(pen: "ImageDraw.ImageDraw", view: Viewport, segments: Array, color: Color) -> None:
    for a, b in zip(view.pixels(segments[:, 0]), view.pixels(segments[:, 1]), strict=True):
        pen.line((a, b), fill=color, width=SUPERSAMPLING + 1)


def _draw_names(pen: "ImageDraw.ImageDraw", view: Viewport, built: BuiltWorld) -> None:
    for name, polygon in built.world.regions.items():
        upper_left = np.array([[min(x for x, _ in polygon), max(y for _, y in polygon)]])
        _draw_text(pen, view.pixels(upper_left)[0], name, REGION_COLOR)
    for body in built.world.bodies:
        _draw_text(pen, view.pixels(np.array([body.pose.position[:2]]))[0], body.name, BODY_COLOR)
    for name, place in built.world.places.items():
        tip = place.apply(np.array([[0.0, 0.0], [0.3, 0.0]]))
        (x, y), end = view.pixels(tip)
        pen.line(((x, y), end), fill=PLACE_COLOR, width=2 * SUPERSAMPLING)
        radius = 4 * SUPERSAMPLING
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=PLACE_COLOR)
        _draw_text(pen, (x, y), name, PLACE_COLOR)


def _draw_text(pen: "ImageDraw.ImageDraw", point: tuple[float, float], text: str, color: Color) -> None:
    """Write a text to the lower right of a point of the canvas."""
    from PIL import ImageFont

    font = ImageFont.load_default(13 * SUPERSAMPLING)
    x, y = point[0] + 6 * SUPERSAMPLING, point[1] + 4 * SUPERSAMPLING
    pen.text((x, y), text, fill=color, font=font, stroke_width=SUPERSAMPLING, stroke_fill=(255, 255, 255, 220))


def _draw_scale_bar(pen: "ImageDraw.ImageDraw", view: Viewport) -> None:
    """Draw a scale bar in the lower left corner: 1, 2 or 5 times a power of ten m, at most a fifth of the width."""
    max_length = view.size[0] / view.scale / 5
    power = 10.0 ** math.floor(math.log10(max_length))
    meters = max(step * power for step in (1, 2, 5) if step * power <= max_length)
    x, y = 14 * SUPERSAMPLING, view.size[1] - 14 * SUPERSAMPLING
    pen.line((x, y, x + meters * view.scale, y), fill=SCALE_BAR_COLOR, width=3 * SUPERSAMPLING)
    _draw_text(pen, (x - 6 * SUPERSAMPLING, y - 24 * SUPERSAMPLING), f"{meters:g} m", SCALE_BAR_COLOR)
