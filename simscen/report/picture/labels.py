"""Placement of labels next to the drawn parts that they name, if possible not on paths, goals, or other labels."""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array
from simscen.report.picture import palette
from simscen.report.picture.canvas import LABEL_CELL_PX, Canvas, TextItem, text_size
from simscen.report.picture.palette import Color

_DISTANCES_PX = (4.0, 12.0, 22.0, 36.0, 54.0, 76.0, 104.0, 140.0)
"""Distances between the rim of a part and its label, in the order of the trials."""
_ANGLES_RAD = tuple(math.radians(degrees) for degrees in (0, 180, 90, 270, 30, 150, 330, 210, 60, 120, 300, 240))
"""Directions from a part to its label, in the order of the trials."""
_LEADER_DISTANCE_PX = 16.0
"""Distance between a label and the rim of its part above which a line connects label and part."""
_WALL_COST, _LABEL_COST, _COST_PER_PX = 0.25, 3.0, 0.0015
"""Costs of a label on walls, on another label, and per pixel of distance. The cost on a blocked label cell is 1."""
_MAX_OPTIONAL_COST = 0.2
"""Cost above which an optional label is omitted."""


@dataclass(frozen=True)
class Label:
    """Text with the font `size` in pixels that names a part at (x, y) in m with a radius of `rim` pixels.

    Labels with a low `rank` are placed first. `box` is the color of a box behind the text; None for no box. An optional
    label is omitted if there is no free space.
    """

    rank: int
    x: float
    y: float
    text: str
    color: Color
    size: int = 12
    rim: float = 6.0
    box: Color | None = None
    is_optional: bool = False


def place_labels(canvas: Canvas, labels: list[Label], walls: Array) -> None:
    """Choose a position for each label, and draw the label. Labels of parts outside of the canvas are omitted.

    `walls` is 1.0 for each label cell of the canvas in a wall, and 0.0 for the others.
    """
    occupied = canvas.blocked_cells + _WALL_COST * walls
    for label in sorted(labels, key=lambda label: label.rank):
        if not canvas.shows(label.x, label.y):
            continue
        cost, (left, top, right, bottom) = _best_box(canvas, label, occupied)
        if label.is_optional and cost > _MAX_OPTIONAL_COST:
            continue
        rows, columns = (
            slice(int(top // LABEL_CELL_PX), int(bottom // LABEL_CELL_PX) + 1),
            slice(int(left // LABEL_CELL_PX), int(right // LABEL_CELL_PX) + 1),
        )
        occupied[rows, columns] = _LABEL_COST
        u, v = canvas.pixel(label.x, label.y)
        end = min(max(u, left), right), min(max(v, top), bottom)
        distance = math.dist((u, v), end)
        if distance > label.rim + _LEADER_DISTANCE_PX:
            fraction = label.rim / distance
            canvas.leader((u + fraction * (end[0] - u), v + fraction * (end[1] - v)), end, label.box or label.color)
        halo = None if label.box else palette.FREE
        middle = (left + right) / 2, (top + bottom) / 2
        canvas.texts.append(TextItem(*middle, label.text, label.size, label.color, "mm", label.box, halo))
        canvas.add_part(f"label {label.text}", [(label.x, label.y)])


Box = tuple[float, float, float, float]
"""Left, top, right and bottom in pixels."""


def _best_box(canvas: Canvas, label: Label, occupied: Array) -> tuple[float, Box]:
    """Return (cost, box) of the best position of a label. `occupied` is the cost of each label cell."""
    sums = np.zeros((occupied.shape[0] + 1, occupied.shape[1] + 1))
    sums[1:, 1:] = occupied.cumsum(axis=0).cumsum(axis=1)
    width, height = text_size(label.text, label.size)
    width, height = width + 10, height + 10
    u, v = canvas.pixel(label.x, label.y)
    best: tuple[float, Box] = (math.inf, (u, v, u + width, v + height))
    for distance in _DISTANCES_PX:
        if best[0] <= _COST_PER_PX * distance:
            break  # boxes at larger distances cannot be better
        for number, angle in enumerate(_ANGLES_RAD):
            box = _box(canvas, (u, v), angle, label.rim + distance, (width, height))
            cost = _mean_cost(sums, box) + _COST_PER_PX * (distance + number / 4)
            if cost < best[0]:
                best = (cost, box)
    return best


def _box(canvas: Canvas, center: tuple[float, float], angle: float, distance: float, size: tuple[float, float]) -> Box:
    """Return a box of `size` (width, height) at `distance` in px and `angle` in rad from the pixel `center`.

    A box that extends beyond the canvas is moved onto the canvas.
    """
    c, s = math.cos(angle), -math.sin(angle)
    middle = center[0] + c * (distance + abs(c) * size[0] / 2), center[1] + s * (distance + abs(s) * size[1] / 2)
    if abs(c) > 0.1 and abs(s) > 0.1:  # diagonal: next to the part, not above it
        middle = center[0] + math.copysign(distance * abs(c) + size[0] / 2, c), middle[1]
    left = min(max(middle[0] - size[0] / 2, 2.0), max(2.0, canvas.width - size[0] - 2.0))
    top = min(max(middle[1] - size[1] / 2, 2.0), max(2.0, canvas.height - size[1] - 2.0))
    return left, top, left + size[0], top + size[1]


def _mean_cost(sums: Array, box: Box) -> float:
    """Return the mean cost of the label cells in a box. `sums` is the summed-area table of the costs."""
    left, top, right, bottom = (int(part // LABEL_CELL_PX) for part in box)
    right, bottom = min(right + 1, sums.shape[1] - 1), min(bottom + 1, sums.shape[0] - 1)
    inside = float(sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left])
    cells: int = max(1, (right - left) * (bottom - top))
    return inside / cells
