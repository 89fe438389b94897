"""Canvas for drawing anti-aliased shapes and text in world coordinates with Pillow.

The canvas also lists the drawn parts, so that the legend explains only these parts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from simscen.core.geometry import Array
from simscen.report.display_text import one_line
from simscen.report.picture.palette import Color

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
Bounds = tuple[float, float, float, float]
"""Rectangle in world coordinates: lowest x, lowest y, highest x, highest y in m."""
Fill = tuple[int, ...]
"""Red, green, and blue from 0 to 255, optionally followed by the opacity from 0 to 255."""

SUPERSAMPLING = 2
"""Scale of the image in which shapes are drawn. `finish` reduces it to the final size (anti-aliasing)."""
LABEL_CELL_PX = 4
"""Side of a label cell. In a grid of these cells, the canvas tracks which areas labels should not cover."""

HATCH_SPACING_PX = 11.0
"""Distance between the lines with which `hatch` fills a polygon."""
MAX_ELLIPSE_RADIUS_PX, _SIDES_OF_LARGE_DISC = 4000.0, 2000
"""Maximum radius of a disc that is drawn as an ellipse, and number of sides of the polygon for a larger disc."""


@lru_cache(maxsize=16)
def font(size: int) -> Font:
    """Return the built-in font of Pillow in `size` pixels. This font is the same on every machine."""
    return ImageFont.load_default(size)


@dataclass(frozen=True)
class TextItem:
    """Text to draw at pixel (x, y) with the font `size` in pixels. `anchor` is the text anchor of Pillow.

    `box` is the color of a box behind the text, `halo` the color of an outline around the letters; None for none.
    """

    x: float
    y: float
    text: str
    size: int
    color: Color
    anchor: str = "lm"
    box: Color | None = None
    halo: Color | None = None


class DrawnPart(NamedTuple):
    """Entry in the list of drawn parts: a name such as "door meeting room", and points (n, 2) in m."""

    name: str
    points: Array


class Canvas:
    """Image of the rectangle `bounds` of the world, with `scale` pixels per meter; y points up.

    Points of shapes are in m, widths and radii in pixels. Labels avoid symbols, and shapes with `blocks_labels`.
    `finish` draws `texts` on top of all shapes. `parts` is the list of drawn parts.
    """

    def __init__(self, bounds: Bounds, scale: float, background: Color | None) -> None:
        """Create an image with a `background` color. With None, the caller must call `set_image` before drawing."""
        self.bounds, self.scale = bounds, scale
        x0, y0, x1, y1 = bounds
        self.width, self.height = max(1, math.ceil((x1 - x0) * scale)), max(1, math.ceil((y1 - y0) * scale))
        if background is not None:
            self.set_image(Image.new("RGB", self.supersampled_size, background))
        self._blocked = Image.new("L", (-(-self.width // LABEL_CELL_PX), -(-self.height // LABEL_CELL_PX)), 0)
        self._block_pen = ImageDraw.Draw(self._blocked)
        self.texts: list[TextItem] = []
        self.parts: list[DrawnPart] = []

    def set_image(self, image: Image.Image) -> None:
        """Draw on this image, without a copy. The size of the image must be `supersampled_size`."""
        self._image, self._draw = image, ImageDraw.Draw(image, "RGBA")

    @property
    def supersampled_size(self) -> tuple[int, int]:
        """Width and height in pixels of the image before it is reduced by SUPERSAMPLING."""
        return self.width * SUPERSAMPLING, self.height * SUPERSAMPLING

    @property
    def blocked_cells(self) -> Array:
        """1.0 for each label cell that labels should not cover, and 0.0 for the others. The top row is first."""
        return np.asarray(self._blocked, dtype=np.float64) / 255

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixel (column, row) of a point in m. The pixel can be outside of the image."""
        return (x - self.bounds[0]) * self.scale, (self.bounds[3] - y) * self.scale

    def shows(self, x: float, y: float) -> bool:
        """Return whether a point in m is on the canvas."""
        u, v = self.pixel(x, y)
        return 0 <= u < self.width and 0 <= v < self.height

    def add_part(self, name: str, points: Array | Sequence[tuple[float, float]]) -> None:
        """Add an entry to the list of drawn parts."""
        self.parts.append(DrawnPart(name, np.array(points, dtype=np.float64).reshape(-1, 2)))

    def polygon(
        self,
        points: Array,
        fill: Fill | None,
        outline: Color | None = None,
        width: float = 1.5,
        blocks_labels: bool = False,
    ) -> None:
        """Draw a polygon of points (n, 2) in meters, with an outline of `width` pixels."""
        corners = self._corners(points)
        if fill is not None:
            self._draw.polygon(corners, fill=fill)
        if outline is not None:
            self._draw.line([*corners, corners[0]], fill=outline, width=_line_width(width), joint="curve")
        if blocks_labels:
            self._block_pen.polygon(_label_cells(corners), fill=255)

    def hatch(self, outlines: Sequence[Array], color: Fill, rising: bool) -> None:
        """Fill polygons with slanted lines. With `rising`, the lines rise to the right."""
        corners = [self._corners(outline) for outline in outlines]
        points = np.array([corner for outline in corners for corner in outline]).reshape(-1, 2)
        if not len(points):
            return
        max_right, max_bottom = self.supersampled_size
        (left, top), (right, bottom) = np.floor(points.min(axis=0)), np.ceil(points.max(axis=0))
        left, top = max(left, 0), max(top, 0)
        width_px, height_px = int(min(right, max_right) - left) + 1, int(min(bottom, max_bottom) - top) + 1
        if width_px < 1 or height_px < 1:
            return
        inside, lines = Image.new("L", (width_px, height_px), 0), Image.new("L", (width_px, height_px), 0)
        pen, fill = ImageDraw.Draw(lines), ImageDraw.Draw(inside)
        for outline in corners:
            fill.polygon([(u - left, v - top) for u, v in outline], fill=255)
        step = HATCH_SPACING_PX * SUPERSAMPLING
        # Multiples of `step`, so that the lines of all polygons of the canvas are aligned.
        first = -step * math.ceil(height_px / step) - ((left + (top if rising else -top)) % step)
        for offset in np.arange(first, width_px + height_px, step).tolist():
            top_end, bottom_end = (offset, 0), (offset - height_px if rising else offset + height_px, height_px)
            pen.line([top_end, bottom_end], fill=color[3] if len(color) > 3 else 255, width=_line_width(1.2))
        lines.paste(0, (0, 0), inside.point(lambda value: 255 - value))
        self._image.paste(color[:3], (int(left), int(top)), lines)

    def line(self, points: Array, color: Fill, width: float = 1.5, blocks_labels: bool = False) -> None:
        """Draw a line through points (n, 2) in meters."""
        if len(points) > 1:
            corners = self._corners(points)
            self._draw.line(corners, fill=color, width=_line_width(width), joint="curve")
            if blocks_labels:
                self._block_pen.line(_label_cells(corners), fill=255, width=2)

    def dashes(self, points: Array, color: Color, width: float = 1.5, dash: float = 5.0) -> None:
        """Draw a dashed line; `dash` is the length of a dash and of a gap in pixels."""
        if len(points) < 2:
            return
        lengths = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T)))) * self.scale / dash
        strokes = np.arange(0.0, lengths[-1], 2.0)
        ends = np.column_stack((strokes, np.minimum(strokes + 1, lengths[-1]))).ravel()
        corners = self._corners(np.column_stack([np.interp(ends, lengths, points[:, axis]) for axis in (0, 1)]))
        for start, end in zip(corners[::2], corners[1::2], strict=True):
            self._draw.line((start, end), fill=color, width=_line_width(width))

    def disc(
        self,
        x: float,
        y: float,
        radius: float,
        fill: Fill | None,
        outline: Color | None = None,
        width: float = 1.5,
        blocks_labels: bool = False,
    ) -> None:
        """Draw a disc of `radius` pixels around a point in meters."""
        if radius > MAX_ELLIPSE_RADIUS_PX:
            angles = np.linspace(0.0, 2.0 * math.pi, _SIDES_OF_LARGE_DISC, endpoint=False)
            ring = radius / self.scale * np.column_stack((np.cos(angles), np.sin(angles)))
            self.polygon(np.array((x, y)) + ring, fill, outline, width, blocks_labels)
            return
        u, v = (SUPERSAMPLING * part for part in self.pixel(x, y))
        r = SUPERSAMPLING * radius
        box = (u - r, v - r, u + r, v + r)
        self._draw.ellipse(box, fill=fill, outline=outline, width=_line_width(width))
        if blocks_labels:
            self._block_pen.ellipse([part / SUPERSAMPLING / LABEL_CELL_PX for part in box], fill=255)

    def symbol(self, x: float, y: float, offsets: Sequence[tuple[float, float]], fill: Color) -> None:
        """Draw a filled polygon at a point in meters. Corners are `offsets` in pixels from the point, y down."""
        u, v = self.pixel(x, y)
        self._draw.polygon([((u + dx) * SUPERSAMPLING, (v + dy) * SUPERSAMPLING) for dx, dy in offsets], fill=fill)
        self._block_pen.polygon([((u + dx) / LABEL_CELL_PX, (v + dy) / LABEL_CELL_PX) for dx, dy in offsets], fill=255)

    def leader(self, start: tuple[float, float], end: tuple[float, float], color: Color) -> None:
        """Draw a thin line that connects a label with the part that it names. `start` and `end` are pixels."""
        self._draw.line(
            [(u * SUPERSAMPLING, v * SUPERSAMPLING) for u, v in (start, end)], fill=color, width=_line_width(0.8)
        )

    def finish(self) -> Image.Image:
        """Return the image in its final size, with all texts."""
        image = self._image.reduce(SUPERSAMPLING)
        draw = ImageDraw.Draw(image, "RGBA")
        for item in self.texts:
            draw_text(draw, item)
        return image

    def _corners(self, points: Array) -> list[tuple[float, float]]:
        """Return the pixels of points (n, 2), given in m, in the supersampled image."""
        u = (points[:, 0] - self.bounds[0]) * self.scale * SUPERSAMPLING
        v = (self.bounds[3] - points[:, 1]) * self.scale * SUPERSAMPLING
        return list(zip(u.tolist(), v.tolist(), strict=True))


def _label_cells(corners: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Convert pixels of the supersampled image to coordinates in the grid of label cells."""
    return [(u / SUPERSAMPLING / LABEL_CELL_PX, v / SUPERSAMPLING / LABEL_CELL_PX) for u, v in corners]


def printable(text: str) -> str:
    """Return a text on one line, with "<=" and ">=" instead of symbols that the built-in font lacks."""
    return one_line(text).replace("≤", "<=").replace("≥", ">=")


def draw_text(draw: ImageDraw.ImageDraw, item: TextItem) -> None:
    """Draw a text with its box and halo. `draw` draws on an image of the final size."""
    if item.box is not None:
        left, top, right, bottom = draw.textbbox((item.x, item.y), item.text, font(item.size), anchor=item.anchor)
        draw.rounded_rectangle((left - 5, top - 4, right + 5, bottom + 4), 4, fill=(*item.box, 235))
    draw.text(
        (item.x, item.y),
        item.text,
        fill=item.color,
        font=font(item.size),
        anchor=item.anchor,
        stroke_width=0 if item.halo is None else 3,
        stroke_fill=item.halo,
    )


def text_size(text: str, size: int) -> tuple[float, float]:
    """Return width and height of a text in pixels."""
    left, top, right, bottom = font(size).getbbox(text)
    return right - left, bottom - top


def _line_width(width: float) -> int:
    """Return the width of a line in the supersampled image, at least one pixel."""
    return max(1, round(width * SUPERSAMPLING))
