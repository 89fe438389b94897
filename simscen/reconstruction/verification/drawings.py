"""SVG drawings for the comparison of two drives: a drive on the map, and charts of values over time."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from PIL import Image

from simscen.core.environment.occupancy_grid import OCCUPIED, UNKNOWN
from simscen.core.geometry import Array
from simscen.reconstruction.drive.gaps import scans_with_pose
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.scenario.incidents import Incident
from simscen.reconstruction.static_world import StaticWorld, beam_ends, lidar_poses

WALL_COLOR, UNKNOWN_COLOR, NEW_HIT_COLOR = (112, 117, 128, 255), (128, 133, 144, 60), (219, 39, 119, 255)
"""RGBA colors of occupied cells, unknown cells, and cells with a lidar return that is not from a wall."""
MAX_WALL_DISTANCE_M = 0.15
"""Maximum distance between a wall and a lidar return from the wall."""
TARGET_SCANS, TARGET_POINTS = 300, 600
"""Numbers of scans, and of points of a line, to which a drawing is thinned.

At least this many are drawn, and fewer than twice as many. Shorter data is drawn completely.
"""
MAX_TIME_MARKS, MIN_MARK_DISTANCE_FRACTION = 12, 0.06
"""Maximum number of time marks on a path, and minimum distance of marks as a fraction of the larger side of the map."""
MARGIN_M, MIN_ASPECT = 1.0, 0.45
"""Distance between the edge of a map and the drawn points, and minimum ratio of the shorter to the longer side."""
FONT_FRACTION = 0.026
"""Height of the text in a map as a fraction of the larger side."""
CHART_WIDTH, CHART_HEIGHT, LEFT_MARGIN, BOTTOM_MARGIN = 420.0, 150.0, 40.0, 18.0
"""Size of a chart, and size of the left and bottom margins with labels, in units of the SVG."""
TICK_STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0)
"""Possible steps between the ticks of an axis in the unit of the axis, and between the time marks on a path in s."""


@dataclass(frozen=True)
class Box:
    """Part of the world that a drawing shows: lowest x and y in m in the map frame, width and height in m."""

    x: float
    y: float
    width: float
    height: float

    @property
    def font_size(self) -> float:
        """Height of the text in m."""
        return FONT_FRACTION * max(self.width, self.height)


def box_around(drives: Sequence[RecordedDrive], objects: Sequence[FoundObject]) -> Box:
    """Return the box around the paths and goals of all drives and the objects."""
    points = [drive.poses.values[:, :2] for drive in drives]
    points += [np.array([[goal.pose.x, goal.pose.y]]) for drive in drives for goal in drive.goals]
    points += [np.array(thing.keyframes)[:, 1:3] for thing in objects]
    all_points = np.concatenate(points)
    size = np.ptp(all_points, axis=0) + 2 * MARGIN_M
    size = np.maximum(size, MIN_ASPECT * size.max())
    x, y = ((all_points.min(axis=0) + all_points.max(axis=0) - size) / 2).tolist()
    width, height = size.tolist()
    return Box(x, y, width, height)


def drive_map(
    label: str,
    css_class: str,
    drive: RecordedDrive,
    other_drive: RecordedDrive,
    objects: Sequence[FoundObject],
    incidents: Sequence[Incident],
    world: StaticWorld,
    box: Box,
) -> str:
    """Return an SVG with a drive, goals, incidents, and objects on the map, and with the path of the other drive.

    `label` is for screen readers. `css_class` is the CSS class of the drive: "log" or "run".
    """
    grid = world.grid
    height, width = (cells * grid.resolution for cells in grid.shape)
    x, y, _ = grid.origin
    image = _map_image(world, drive)
    shapes = [f'<image href="{image}" x="{x:.3f}" y="{-y - height:.3f}" width="{width:.3f}" height="{height:.3f}"/>']
    other_class = "run" if css_class == "log" else "log"
    shapes.append(f'<polyline class="other {other_class}" points="{_svg_points(other_drive.poses.values)}"/>')
    shapes += [part for thing in objects for part in _object_shapes(thing, box)]
    shapes.append(f'<polyline class="path {css_class}" points="{_svg_points(drive.poses.values)}"/>')
    shapes += _time_marks(drive, css_class, box)
    for goal in drive.goals:
        x, y, _ = goal.pose
        shapes.append(f'<circle class="goal" cx="{x:.3f}" cy="{-y:.3f}" r="{0.6 * box.font_size:.3f}"/>')
        shapes.append(_text(x, y - 1.7 * box.font_size, goal.name, box, "goalname"))
    for index, incident in enumerate(incidents):
        x, y = incident.position
        title = f"<title>{escape(f'{incident.kind} at {incident.time:.2f} s')}</title>"
        shapes.append(f'<circle class="incident" cx="{x:.3f}" cy="{-y:.3f}" r="{box.font_size:.3f}">{title}</circle>')
        # Texts alternate above and below, so that the texts of close incidents do not overlap.
        level = 1 + index // 2
        offset_y = (1.7 * level if index % 2 == 0 else -0.7 - 1.7 * level) * box.font_size
        shapes.append(_text(x, y + offset_y, f"{incident.kind}, {incident.time:.1f} s", box, "incidentname"))
    view = f"{box.x:.3f} {-box.y - box.height:.3f} {box.width:.3f} {box.height:.3f}"
    return f'<svg role="img" aria-label="{escape(label)}" viewBox="{view}">{"".join(shapes)}</svg>'


def _text(x: float, y: float, text: str, box: Box, css_class: str = "") -> str:
    """Return an SVG text that is centered at (x, y) in m. It is moved horizontally into the box if necessary."""
    half_width = 0.27 * box.font_size * len(text)
    x = min(max(x, box.x + half_width), box.x + box.width - half_width)
    return f'<text class="{css_class}" x="{x:.2f}" y="{-y:.2f}" font-size="{box.font_size:.3f}">{escape(text)}</text>'


def _time_marks(drive: RecordedDrive, css_class: str, box: Box) -> Iterator[str]:
    """Yield dots with times on the path, and an arrow at the end of the path."""
    step = next((step for step in TICK_STEPS if drive.duration / step <= MAX_TIME_MARKS), TICK_STEPS[-1])
    step = max(step, 1.0)
    times = np.append(np.arange(0.0, drive.duration, step), drive.duration)
    poses = drive.poses.poses_at(times)
    min_distance = MIN_MARK_DISTANCE_FRACTION * max(box.width, box.height)
    last_position = None
    for time, (x, y, _) in zip(times.tolist()[:-1], poses.tolist()[:-1], strict=True):
        if last_position is not None and math.dist(last_position, (x, y)) < min_distance:
            continue
        last_position = (x, y)
        yield f'<circle class="mark {css_class}" cx="{x:.3f}" cy="{-y:.3f}" r="{0.28 * box.font_size:.3f}"/>'
        yield _text(x, y + 0.6 * box.font_size, f"{time:.0f} s", box)
    x, y, yaw = poses[-1].tolist()
    size = 0.8 * box.font_size
    corners = " ".join(
        f"{x + size * math.cos(yaw + turn):.3f},{-y - size * math.sin(yaw + turn):.3f}" for turn in (0.0, 2.5, -2.5)
    )
    yield f'<polygon class="mark {css_class}" points="{corners}"><title>end at {times[-1]:.1f} s</title></polygon>'


def _object_shapes(thing: FoundObject, box: Box) -> Iterator[str]:
    """Yield the path of a moving object or the outline of a stationary object, and its name."""
    _, x, y, yaw = thing.keyframes[0]
    if thing.is_moving:
        yield f'<polyline class="object" points="{_svg_points(np.array(thing.keyframes)[:, 1:3])}"/>'
        yield f'<circle class="object start" cx="{x:.3f}" cy="{-y:.3f}" r="{0.25 * box.font_size:.3f}"/>'
    elif thing.is_cylinder:
        yield f'<circle class="object" cx="{x:.3f}" cy="{-y:.3f}" r="{thing.size[0]:.3f}"/>'
    else:
        length, width = thing.size
        transform = f"translate({x:.3f} {-y:.3f}) rotate({-math.degrees(yaw):.1f})"
        rectangle = f'x="{-length / 2:.3f}" y="{-width / 2:.3f}" width="{length:.3f}" height="{width:.3f}"'
        yield f'<rect class="object" {rectangle} transform="{transform}"/>'
    yield _text(x, y + 0.6 * box.font_size, thing.name, box, "objectname")


def _svg_points(poses: Array) -> str:
    """Return the attribute `points` of an SVG line through poses (n, 2 or more) x, y, …"""
    step = max(1, len(poses) // TARGET_POINTS)
    return " ".join(f"{x:.2f},{-y:.2f}" for x, y in poses[::step, :2].tolist())


def _map_image(world: StaticWorld, drive: RecordedDrive) -> str:
    """Return the data URL of a PNG with the map and the lidar returns that are not from walls."""
    grid = world.grid
    colors = np.zeros((*grid.shape, 4), dtype=np.uint8)
    colors[grid.cells == UNKNOWN] = UNKNOWN_COLOR
    colors[grid.cells == OCCUPIED] = WALL_COLOR
    cells = grid.cell_of(_returns_not_from_walls(world, drive))
    cells = cells[grid.inside(cells)]
    colors[cells[:, 0], cells[:, 1]] = NEW_HIT_COLOR
    out = io.BytesIO()
    Image.fromarray(colors[::-1]).quantize(16).save(out, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(out.getvalue()).decode()}"


def _returns_not_from_walls(world: StaticWorld, drive: RecordedDrive) -> Array:
    """Return the ends (n, 2) in the map frame of beams that ended away from walls."""
    if drive.scans is None:
        return np.empty((0, 2))
    scans = scans_with_pose(drive, drive.scans).thinned(TARGET_SCANS)
    ends: Array = beam_ends(lidar_poses(drive, scans), scans.angles, scans.ranges)[scans.is_hit()]
    return ends[world.distance_to_walls(ends) > MAX_WALL_DISTANCE_M]


@dataclass(frozen=True, eq=False)
class Series:
    """Line of a chart: values (n,) at times (n,) in s."""

    css_class: str
    times: Array
    values: Array


def chart(label: str, series: Sequence[Series], unit: str) -> str:
    """Return an SVG chart of lines over time, with axes that start at 0. `label` is for screen readers."""
    series = [line for line in series if len(line.times)]
    end = max((float(line.times[-1]) for line in series), default=1.0) or 1.0
    top = max(0.1, *(float(np.max(line.values)) for line in series)) if series else 1.0
    width, height = CHART_WIDTH - LEFT_MARGIN - 10.0, CHART_HEIGHT - BOTTOM_MARGIN - 8.0
    parts = []
    for value in _ticks(top, 5):
        y = CHART_HEIGHT - BOTTOM_MARGIN - height * value / top
        parts.append(f'<line class="axis" x1="{LEFT_MARGIN:g}" y1="{y:.1f}" x2="{CHART_WIDTH - 10:g}" y2="{y:.1f}"/>')
        parts.append(
            f'<text class="tick" x="{LEFT_MARGIN - 4:g}" y="{y + 4:.1f}" font-size="11">{value:g} {escape(unit)}</text>'
        )
    for value in _ticks(end, 7):
        x = LEFT_MARGIN + width * value / end
        parts.append(f'<text x="{x:.1f}" y="{CHART_HEIGHT - 4:g}" font-size="11">{value:g} s</text>')
    for line in series:
        step = max(1, len(line.times) // TARGET_POINTS)
        points = " ".join(
            f"{LEFT_MARGIN + width * time / end:.1f},{CHART_HEIGHT - BOTTOM_MARGIN - height * value / top:.1f}"
            for time, value in zip(line.times[::step].tolist(), line.values[::step].tolist(), strict=True)
        )
        parts.append(f'<polyline class="path line {line.css_class}" points="{points}"/>')
    view = f"0 -4 {CHART_WIDTH:g} {CHART_HEIGHT + 4:g}"
    return f'<svg role="img" aria-label="{escape(label)}" viewBox="{view}">{"".join(parts)}</svg>'


def _ticks(top: float, count: int) -> list[float]:
    """Return at most `count` round values from 0 to `top`."""
    step = next((step for step in TICK_STEPS if top / step <= count - 1), top)
    return [round(step * number, 3) for number in range(int(top / step + 1e-9) + 1)]
