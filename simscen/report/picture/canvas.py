"""A canvas in meters: shapes are drawn twice as large and shrunk, text is set sharp on top.

It keeps a list of what was drawn, in meters, so that a picture can be compared part by part.
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
Fill = tuple[int, ...]

SUPERSAMPLING = 2
"""Supersampling: 2 is where edges look smooth; 3 costs twice the time for no visible gain."""
LABEL_CELL_PX = 4
"""Pixels of a cell in which labels look for room."""


@lru_cache(maxsize=16)
def font(size: int) -> Font:
    """Pillow's own typeface: the same on every machine."""
    return ImageFont.load_default(size)


@dataclass(frozen=True)
class TextItem:
    """Text to be set at pixel (x, y): `anchor` as in Pillow; `box` paints a plate of that color behind it.

    Without one, `halo` rims the letters, so that they can be read on anything.
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
    """Something on a picture: what it is ("door meeting room"), and its points (n, 2) in meters of the world."""

    what: str
    points: Array


class Canvas:
    """The part `bounds` (x0, y0, x1, y1) of the plane, y up, at `scale` pixels a meter.

    What is drawn with `part` is on the list of `parts`; with `busy`, labels keep off it.
    """

    def __init__(self, bounds: Bounds, scale: float, background: Color | None) -> None:
        """Without a `background`, an image has to be laid before anything is drawn."""
        self.bounds, self.scale = bounds, scale
        x0, y0, x1, y1 = bounds
        self.width, self.height = max(1, math.ceil((x1 - x0) * scale)), max(1, math.ceil((y1 - y0) * scale))
        if background is not None:
            self.lay(Image.new("RGB", self.samples, background))
        self._busy = Image.new("L", (-(-self.width // LABEL_CELL_PX), -(-self.height // LABEL_CELL_PX)), 0)
        self._keep_off = ImageDraw.Draw(self._busy)
        self.notes: list[TextItem] = []
        self.parts: list[DrawnPart] = []

    def lay(self, image: Image.Image) -> None:
        """Draw from now on upon this image, which is as large as the whole canvas, supersampled: nobody copies it."""
        self._image, self._draw = image, ImageDraw.Draw(image, "RGBA")

    @property
    def samples(self) -> tuple[int, int]:
        """Width and height of the supersampled image."""
        return self.width * SUPERSAMPLING, self.height * SUPERSAMPLING

    @property
    def busy(self) -> Array:
        """Where labels should not be: a share 0 … 1 for each cell of COARSE pixels, rows from the top."""
        return np.asarray(self._busy, dtype=np.float64) / 255

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """The pixel of a point of the plane."""
        return (x - self.bounds[0]) * self.scale, (self.bounds[3] - y) * self.scale

    def shows(self, x: float, y: float) -> bool:
        """Whether a point of the plane is on it."""
        u, v = self.pixel(x, y)
        return 0 <= u < self.width and 0 <= v < self.height

    def tell(self, what: str, points: Array | Sequence[tuple[float, float]]) -> None:
        """Put something on the list of parts."""
        self.parts.append(DrawnPart(what, np.array(points, dtype=np.float64).reshape(-1, 2)))

    def polygon(
        self, points: Array, fill: Fill | None, outline: Color | None = None, width: float = 1.5, busy: bool = False
    ) -> None:
        """A closed shape; points (n, 2) in meters, `width` in pixels."""
        corners = self._corners(points)
        if fill is not None:
            self._draw.polygon(corners, fill=fill)
        if outline is not None:
            self._draw.line([*corners, corners[0]], fill=outline, width=_line_width(width), joint="curve")
        if busy:
            self._keep_off.polygon(
                [(u / SUPERSAMPLING / LABEL_CELL_PX, v / SUPERSAMPLING / LABEL_CELL_PX) for u, v in corners], fill=255
            )

    def hatch(
        self, outlines: Sequence[Array], color: Fill, rising: bool, gap: float = 11.0, width: float = 1.2
    ) -> None:
        """Slanted lines in closed shapes, `gap` pixels apart; `rising` to the right, or falling."""
        corners = [self._corners(outline) for outline in outlines]
        points = np.array([corner for outline in corners for corner in outline]).reshape(-1, 2)
        if not len(points):
            return
        (left, top), (right, low) = np.floor(points.min(axis=0)), np.ceil(points.max(axis=0))
        left, top = max(left, 0), max(top, 0)
        wide, high = int(min(right, self.samples[0]) - left) + 1, int(min(low, self.samples[1]) - top) + 1
        if wide < 1 or high < 1:
            return
        inside, lines = Image.new("L", (wide, high), 0), Image.new("L", (wide, high), 0)
        pen, fill = ImageDraw.Draw(lines), ImageDraw.Draw(inside)
        for outline in corners:
            fill.polygon([(u - left, v - top) for u, v in outline], fill=255)
        step = gap * SUPERSAMPLING
        first = -high - ((left + (top if rising else -top)) % step)  # the same slant everywhere on the canvas
        for at in np.arange(first, wide + high, step).tolist():
            ends = [(at, 0), (at - high, high)] if rising else [(at, 0), (at + high, high)]
            pen.line(ends, fill=color[3] if len(color) > 3 else 255, width=_line_width(width))
        lines.paste(0, (0, 0), inside.point(lambda value: 255 - value))
        self._image.paste(color[:3], (int(left), int(top)), lines)

    def line(self, points: Array, color: Fill, width: float = 1.5, busy: bool = False) -> None:
        """A line through points (n, 2) in meters."""
        if len(points) > 1:
            corners = self._corners(points)
            self._draw.line(corners, fill=color, width=_line_width(width), joint="curve")
            if busy:
                self._keep_off.line(
                    [(u / SUPERSAMPLING / LABEL_CELL_PX, v / SUPERSAMPLING / LABEL_CELL_PX) for u, v in corners],
                    fill=255,
                    width=2,
                )

    def dashes(self, points: Array, color: Color, width: float = 1.5, dash: float = 5.0) -> None:
        """A dashed line; `dash` is the length of a dash and of a gap in pixels."""
        if len(points) < 2:
            return
        way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T)))) * self.scale / dash
        strokes = np.arange(0.0, way[-1], 2.0)
        ends = np.column_stack((strokes, np.minimum(strokes + 1, way[-1]))).ravel()
        corners = self._corners(np.column_stack([np.interp(ends, way, points[:, axis]) for axis in (0, 1)]))
        for here, there in zip(corners[::2], corners[1::2], strict=True):
            self._draw.line((here, there), fill=color, width=_line_width(width))

    def disc(
        self,
        x: float,
        y: float,
        radius: float,
        fill: Fill | None,
        outline: Color | None = None,
        width: float = 1.5,
        busy: bool = False,
    ) -> None:
        """A disc of `radius` pixels at a point in meters."""
        u, v = (SUPERSAMPLING * part for part in self.pixel(x, y))
        reach = SUPERSAMPLING * radius
        box = (u - reach, v - reach, u + reach, v + reach)
        self._draw.ellipse(box, fill=fill, outline=outline, width=_line_width(width))
        if busy:
            self._keep_off.ellipse([part / SUPERSAMPLING / LABEL_CELL_PX for part in box], fill=255)

    def sign(self, x: float, y: float, offsets: Sequence[tuple[float, float]], fill: Color) -> None:
        """A filled sign at a point in meters; `offsets` are its corners in pixels, y down. Labels keep off it."""
        u, v = self.pixel(x, y)
        self._draw.polygon([((u + dx) * SUPERSAMPLING, (v + dy) * SUPERSAMPLING) for dx, dy in offsets], fill=fill)
        self._keep_off.polygon([((u + dx) / LABEL_CELL_PX, (v + dy) / LABEL_CELL_PX) for dx, dy in offsets], fill=255)

    def leader(self, here: tuple[float, float], there: tuple[float, float], color: Color) -> None:
        """A thin line between two pixels."""
        self._draw.line(
            [(u * SUPERSAMPLING, v * SUPERSAMPLING) for u, v in (here, there)], fill=color, width=_line_width(0.8)
        )

    def note(self, note: TextItem) -> None:
        """Set text once everything is drawn."""
        self.notes.append(note)

    def finish(self) -> Image.Image:
        """The picture at its final size."""
        image = self._image.reduce(SUPERSAMPLING)
        draw = ImageDraw.Draw(image, "RGBA")
        for note in self.notes:
            draw_text(draw, note)
        return image

    def _corners(self, points: Array) -> list[tuple[float, float]]:
        u = (points[:, 0] - self.bounds[0]) * self.scale * SUPERSAMPLING
        v = (self.bounds[3] - points[:, 1]) * self.scale * SUPERSAMPLING
        return list(zip(u.tolist(), v.tolist(), strict=True))


def printable(text: str) -> str:
    """Text on one line in signs that Pillow's own typeface has."""
    return one_line(text).replace("≤", "<=").replace("≥", ">=")


def draw_text(draw: ImageDraw.ImageDraw, note: TextItem) -> None:
    """Set one text."""
    if note.box is not None:
        left, top, right, bottom = draw.textbbox((note.x, note.y), note.text, font(note.size), anchor=note.anchor)
        draw.rounded_rectangle((left - 5, top - 4, right + 5, bottom + 4), 4, fill=(*note.box, 235))
    draw.text(
        (note.x, note.y),
        note.text,
        fill=note.color,
        font=font(note.size),
        anchor=note.anchor,
        stroke_width=0 if note.halo is None else 3,
        stroke_fill=note.halo,
    )


def text_size(text: str, size: int) -> tuple[float, float]:
    """Width and height of a text in pixels."""
    left, top, right, bottom = font(size).getbbox(text)
    return right - left, bottom - top


def _line_width(width: float) -> int:
    return max(1, round(width * SUPERSAMPLING))
