"""Coordinates: lines of a grid on the map, and their meters along its edges."""

import math

import numpy as np
from PIL import ImageDraw

from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, Note, write

LEFT, BELOW = 40, 26
"""Pixels beside and below the map for its coordinates."""
_APART = 55
"""Pixels that two lines are apart at least."""


def step_of(canvas: Canvas) -> float:
    """A round number of meters between two lines: 1, 2, 5, 10, … times a power of ten."""
    least = _APART / canvas.scale
    power = 10.0 ** math.floor(math.log10(least))
    return next(power * factor for factor in (1, 2, 5, 10) if power * factor >= least)


def lines_of(low: float, high: float, step: float) -> list[float]:
    """The multiples of a step between two coordinates."""
    return [round(k * step, 6) for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def draw_grid(canvas: Canvas) -> None:
    """Faint lines over the floor."""
    x0, y0, x1, y1 = canvas.bounds
    step = step_of(canvas)
    for x in lines_of(x0, x1, step):
        canvas.line(np.array([(x, y0), (x, y1)]), palette.GRID, 0.5)
    for y in lines_of(y0, y1, step):
        canvas.line(np.array([(x0, y), (x1, y)]), palette.GRID, 0.5)
    canvas.tell(f"grid every {step:g} m", [(x0, y0), (x1, y1)])


def write_coordinates(pen: ImageDraw.ImageDraw, canvas: Canvas, left: float, top: float) -> None:
    """The meters of each line, beside the map whose upper left corner is at a pixel of the picture."""
    x0, y0, x1, y1 = canvas.bounds
    step = step_of(canvas)
    for x in lines_of(x0, x1, step):
        u = left + canvas.pixel(x, y0)[0]
        write(pen, Note(u, top + canvas.height + 12, f"{x:g}", 11, palette.FAINT_INK, "mm"))
    for y in lines_of(y0, y1, step):
        v = top + canvas.pixel(x0, y)[1]
        write(pen, Note(left - 7, v, f"{y:g}", 11, palette.FAINT_INK, "rm"))
    write(pen, Note(left - 7, top + canvas.height + 12, "x, y in m", 10, palette.FAINT_INK, "mm"))
