"""Paths on the picture of a run: true path, belief, plans, and the robot at the start and the end.

Each function `draw_…` draws one layer on the canvas, and yields its labels. A layer without labels ends with
`yield from ()`, so that the function is a generator.
"""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Samples
from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, printable
from simscen.report.picture.labels import Label
from simscen.report.picture.scene import Scene

MIN_JUMP_SPEED_M_S, MIN_JUMP_M = 8.0, 0.3
"""Speed and distance above which the motion between two samples counts as a jump."""
_TIME_COLOR_COUNT = 48
"""Number of colors of the true path. Each color stands for an equal part of the duration of the run."""
_DEFAULT_FOOTPRINT = 0.15 * np.column_stack((np.cos(np.arange(24) * np.pi / 12), np.sin(np.arange(24) * np.pi / 12)))
"""Circle with a radius of 0.15 m for a robot without a footprint."""
_LIFTED_SYMBOL = [(-6, -2), (0, -9), (6, -2), (2, -2), (2, 6), (-2, 6), (-2, -2)]
"""Corners of the arrow where a robot was lifted, in pixels from the center, x right and y down."""
_SET_DOWN_SYMBOL = [(x, -y) for x, y in _LIFTED_SYMBOL]
"""Corners of the arrow where a robot was set down."""


def split_at_jumps(samples: Samples, tick_rate: int, placement_ticks: tuple[int, ...] = ()) -> list[Samples]:
    """Split poses at jumps, and at `placement_ticks`.

    `tick_rate` is in ticks per second. `placement_ticks` are the ticks at which an event placed the robot elsewhere.
    """
    if len(samples) < 2:
        return [samples] if len(samples) else []
    distances = np.hypot(*np.diff(samples.values[:, :2], axis=0).T)
    seconds = np.diff(samples.ticks) / tick_rate
    cuts = {*(np.flatnonzero((distances > MIN_JUMP_M) & (distances > MIN_JUMP_SPEED_M_S * seconds)) + 1).tolist()}
    for tick in placement_ticks:
        near = max(0, int(np.searchsorted(samples.ticks, tick)) - 1)
        cuts.add(near + 1 + int(distances[near : near + 2].argmax()) if near < len(distances) else len(samples))
    edges = sorted({0, *cuts, len(samples)})
    return [samples.select(slice(a, b)) for a, b in pairwise(edges)]


def driven_segments(scene: Scene) -> list[Samples]:
    """Return the true path, split where the robot jumped or was placed elsewhere."""
    placement_ticks = tuple(event.tick for event in scene.trace.of_kind(EventKind.ROBOT_PLACED))
    return split_at_jumps(scene.trace.truth, scene.trace.tick_rate, placement_ticks)


def draw_plans(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw all plans; newer plans have stronger colors."""
    plans = scene.trace.plans
    for k, plan in enumerate(plans):
        weight = 0.45 + 0.55 * (k + 1) / len(plans)
        color = tuple(round(255 + weight * (part - 255)) for part in palette.PLAN)
        canvas.line(plan.points[:, :2], (color[0], color[1], color[2]), 3.0)
    yield from ()


def draw_truth(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw the true path, colored by time, with dots at round times and gaps at jumps."""
    trace, pieces = scene.trace, driven_segments(scene)
    edges = np.linspace(0, trace.end, _TIME_COLOR_COUNT + 1)
    for piece in pieces:
        points = piece.values[:, :2]
        canvas.add_part(scene.label("path"), points[[0, -1]])
        if len(scene.robots) > 1:
            canvas.line(
                _drop_close_points(points, canvas), palette.ROBOTS[scene.robot_index % len(palette.ROBOTS)], 6.4
            )
        for k in range(_TIME_COLOR_COUNT):
            first, last = np.searchsorted(piece.ticks, (edges[k], edges[k + 1]), side="left")
            band = points[max(first - 1, 0) : last + 1]
            color = palette.time_color((k + 0.5) / _TIME_COLOR_COUNT)
            canvas.line(_drop_close_points(band, canvas), color, 3.2, blocks_labels=True)
    step = round_time_step(trace.seconds(trace.end))
    for number in range(1, int(trace.seconds(trace.end) / step) + 1) if pieces else ():
        tick = round(number * step * trace.tick_rate)
        if not trace.truth.ticks[0] <= tick <= trace.truth.ticks[-1]:
            continue
        x, y = trace.place(tick)
        canvas.disc(x, y, 3.6, palette.PAGE, palette.time_color(tick / max(trace.end, 1)), 1.6)
    yield from ()


def draw_kidnapping(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw an arrow up and an arrow down at the two ends of each jump of the true path."""
    for before, after in pairwise(driven_segments(scene)):
        when = f"{scene.trace.seconds(int(before.ticks[-1])):.1f} s"
        ends = (before.values[-1], _LIFTED_SYMBOL, "lifted"), (after.values[0], _SET_DOWN_SYMBOL, "set down")
        for pose, symbol, text in ends:
            x, y = pose[:2].tolist()
            canvas.disc(x, y, 12, (255, 255, 255, 225), palette.AMBER, 1.6, blocks_labels=True)
            canvas.symbol(x, y, symbol, palette.AMBER)
            canvas.add_part(scene.label(text), [(x, y)])
            yield Label(1, x, y, printable(scene.label(f"{text} at {when}")), palette.AMBER, 12, 13.0)


def draw_belief(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw the estimated path with gaps at jumps."""
    for piece in split_at_jumps(scene.trace.belief, scene.trace.tick_rate):
        canvas.dashes(_drop_close_points(piece.values[:, :2], canvas), palette.BELIEF, 1.2, 4.0)
        canvas.add_part(scene.label("belief"), piece.values[[0, -1], :2])
    yield from ()


def draw_robot(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw the footprint of the robot at the start and at the end."""
    if not len(scene.trace.truth):
        return
    first, last = (Pose2(*row) for row in scene.trace.truth.values[[0, -1]].tolist())
    footprint = np.array(scene.case.footprint) if len(scene.case.footprint) > 2 else _DEFAULT_FOOTPRINT
    radius = float(np.hypot(*footprint.T).max()) * canvas.scale
    nose = np.array([(0.35, -0.4), (0.85, 0.0), (0.35, 0.4)]) * (
        float(footprint[:, 0].max()),
        float(footprint[:, 1].max()),
    )
    has_moved = first.distance(last) * canvas.scale > radius
    for pose, color, opacity, text in ((first, palette.START, 40, "start"), (last, palette.ROBOT, 170, "end")):
        canvas.polygon(pose.apply(footprint), (*color, opacity), color, blocks_labels=True)
        canvas.polygon(pose.apply(nose), palette.PAGE if opacity > 100 else color)
        canvas.add_part(scene.label(f"robot at the {text}"), pose.apply(footprint))
        if text == "end" or has_moved:
            yield Label(3, pose.x, pose.y, printable(scene.label(text)), color, 12, radius + 1)


def round_time_step(seconds: float) -> float:
    """Return the smallest round time in s (1, 2, 5, 10, …) that divides a run of this length into at most ten parts."""
    if seconds <= 0:
        return 1.0
    power = 10 ** math.floor(math.log10(seconds / 10)) if seconds > 10 else 1.0
    return next(power * factor for factor in (1, 2, 5, 10) if seconds / (power * factor) <= 10)


def _drop_close_points(points: Array, canvas: Canvas) -> Array:
    """Return the points, omitting each point in the same pixel as its predecessor. The last point remains."""
    if len(points) < 3:
        return points
    pixels = np.floor(points * canvas.scale)
    keep = np.concatenate(([True], np.any(np.diff(pixels, axis=0) != 0, axis=1)))
    keep[-1] = True
    result: Array = points[keep]
    return result
