"""A canvas in metres: shapes are drawn twice as large and shrunk, text is set sharp on top."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from simscen.core.geometry import Array
from simscen.report.picture.palette import Colour
from simscen.report.text import one_line

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
Bounds = tuple[float, float, float, float]

SAMPLES = 2
"""Supersampling: 2 is where edges look smooth; 3 costs twice the time for no visible gain."""


@lru_cache(maxsize=16)
def font(size: int) -> Font:
    """Pillow's own typeface: the same on every machine."""
    return ImageFont.load_default(size)


@dataclass(frozen=True)
class Note:
    """Text to be set at pixel (x, y): `anchor` as in Pillow; `box` paints a plate of that colour behind it.

    Without one, `halo` rims the letters, so that they can be read on anything.
    """

    x: float
    y: float
    text: str
    size: int
    colour: Colour
    anchor: str = "lm"
    box: Colour | None = None
    halo: Colour | None = None


class Canvas:
    """The part `bounds` (x0, y0, x1, y1) of the plane, y up, at `scale` pixels a metre."""

    def __init__(self, bounds: Bounds, scale: float, background: Colour) -> None:
        self.bounds, self.scale = bounds, scale
        x0, y0, x1, y1 = bounds
        self.width, self.height = max(1, math.ceil((x1 - x0) * scale)), max(1, math.ceil((y1 - y0) * scale))
        self._image = Image.new("RGB", (self.width * SAMPLES, self.height * SAMPLES), background)
        self._draw = ImageDraw.Draw(self._image, "RGBA")
        self._notes: list[Note] = []

    def paste(self, image: Image.Image) -> None:
        """Put an image of the whole canvas, supersampled, under everything drawn later."""
        self._image.paste(image, (0, 0))

    @property
    def samples(self) -> tuple[int, int]:
        """Width and height of the supersampled image."""
        return self._image.size

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """The pixel of a point of the plane."""
        return (x - self.bounds[0]) * self.scale, (self.bounds[3] - y) * self.scale

    def polygon(
        self, points: Array, fill: tuple[int, ...] | None, outline: Colour | None = None, width: float = 1.5
    ) -> None:
        """A closed shape; points (n, 2) in metres, `width` in pixels."""
        corners = self._corners(points)
        if fill is not None:
            self._draw.polygon(corners, fill=fill)
        if outline is not None:
            self._draw.line([*corners, corners[0]], fill=outline, width=_wide(width), joint="curve")

    def line(self, points: Array, colour: Colour, width: float = 1.5) -> None:
        """A line through points (n, 2) in metres."""
        if len(points) > 1:
            self._draw.line(self._corners(points), fill=colour, width=_wide(width), joint="curve")

    def dashes(self, points: Array, colour: Colour, width: float = 1.5, dash: float = 5.0) -> None:
        """A dashed line; `dash` is the length of a dash and of a gap in pixels."""
        if len(points) < 2:
            return
        way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T)))) * self.scale / dash
        strokes = np.arange(0.0, way[-1], 2.0)
        for begin in strokes.tolist():
            at = np.array([begin, *way[(way > begin) & (way < begin + 1)], min(begin + 1, way[-1])])
            self.line(np.column_stack([np.interp(at, way, points[:, axis]) for axis in (0, 1)]), colour, width)

    def disc(
        self,
        x: float,
        y: float,
        radius: float,
        fill: tuple[int, ...] | None,
        outline: Colour | None = None,
        width: float = 1.5,
    ) -> None:
        """A disc of `radius` pixels at a point in metres."""
        u, v = (SAMPLES * part for part in self.pixel(x, y))
        reach = SAMPLES * radius
        box = (u - reach, v - reach, u + reach, v + reach)
        self._draw.ellipse(box, fill=fill, outline=outline, width=_wide(width))

    def sign(self, x: float, y: float, offsets: Sequence[tuple[float, float]], fill: Colour) -> None:
        """A filled sign at a point in metres; `offsets` are its corners in pixels, y down."""
        u, v = self.pixel(x, y)
        self._draw.polygon([((u + dx) * SAMPLES, (v + dy) * SAMPLES) for dx, dy in offsets], fill=fill)

    def note(self, note: Note) -> None:
        """Set text once everything is drawn."""
        self._notes.append(note)

    def finish(self) -> Image.Image:
        """The picture at its final size."""
        image = self._image.reduce(SAMPLES)
        draw = ImageDraw.Draw(image, "RGBA")
        for note in self._notes:
            write(draw, note)
        return image

    def _corners(self, points: Array) -> list[tuple[float, float]]:
        u = (points[:, 0] - self.bounds[0]) * self.scale * SAMPLES
        v = (self.bounds[3] - points[:, 1]) * self.scale * SAMPLES
        return list(zip(u.tolist(), v.tolist(), strict=True))


def shown(text: str) -> str:
    """Text on one line in signs that Pillow's own typeface has."""
    return one_line(text).replace("≤", "<=").replace("≥", ">=")


def write(draw: ImageDraw.ImageDraw, note: Note) -> None:
    """Set one text."""
    if note.box is not None:
        left, top, right, bottom = draw.textbbox((note.x, note.y), note.text, font(note.size), anchor=note.anchor)
        draw.rounded_rectangle((left - 5, top - 4, right + 5, bottom + 4), 4, fill=(*note.box, 235))
    draw.text(
        (note.x, note.y),
        note.text,
        fill=note.colour,
        font=font(note.size),
        anchor=note.anchor,
        stroke_width=0 if note.halo is None else 3,
        stroke_fill=note.halo,
    )


def text_size(text: str, size: int) -> tuple[float, float]:
    """Width and height of a text in pixels."""
    left, top, right, bottom = font(size).getbbox(text)
    return right - left, bottom - top


def _wide(width: float) -> int:
    return max(1, round(width * SAMPLES))
