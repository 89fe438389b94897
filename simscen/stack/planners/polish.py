"""From a jagged tree path to one a robot likes: shorter, away from walls, evenly spaced, with headings."""

import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.planners.field import Field
from simscen.stack.planners.search import Point

ROUNDS, ENOUGH = 4, 0.999
"""String pulling ends after this many rounds, or when one leaves more than this ratio of the length."""
STRING = 0.2
"""Metres between the points of a path that is being pulled tight."""
SPACING = 0.05
"""Metres between the points of a finished path."""


def pull_tight(field: Field, points: list[Point], radius: float) -> list[Point]:
    """String pulling, from one end and the other in turn, until that makes it no shorter."""
    best = _pulled(field, points, radius)
    for _ in range(ROUNDS):
        before = length(best)
        for _ in range(2):
            best = _pulled(field, spaced(np.array(best), STRING).tolist()[::-1], radius)
        if length(best) > ENOUGH * before:
            break
    return best


def _pulled(field: Field, points: list[Point], radius: float) -> list[Point]:
    """From each kept point straight on to the farthest point that can be seen, found by galloping and bisection."""
    pulled, at, last = [points[0]], 0, len(points) - 1
    while at < last:
        here = points[at]
        seen, step = at + 1, 1
        while seen < last:
            ahead = min(last, seen + step)
            if field.segment_free(*here, *points[ahead], radius):
                seen, step = ahead, step * 2
            elif step == 1:
                break
            else:
                step = max(1, step // 4)
        pulled.append(points[seen])
        at = seen
    return pulled


def length(points: list[Point]) -> float:
    """Length of a polyline in metres."""
    return sum(math.hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points))


def spaced(points: Array, spacing: float) -> Array:
    """The polyline (n, 2) with points at most `spacing` metres apart; its corners are kept, so that none is cut."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    counts = np.maximum(1, np.ceil(lengths / spacing - 1e-9)).astype(np.int64)
    counts[lengths == 0.0] = 0
    first = np.repeat(np.cumsum(counts) - counts, counts)
    part = (np.arange(counts.sum()) - first + 1) / np.repeat(counts, counts)
    inner = np.repeat(points[:-1], counts, axis=0) + part[:, None] * np.repeat(steps, counts, axis=0)
    return np.vstack((points[:1], inner))


def with_headings(points: Array, goal: Pose2) -> Array:
    """Poses (n, 3): each point heads to the next, the last one as the goal does."""
    steps = np.diff(points, axis=0)
    yaw = np.append(np.arctan2(steps[:, 1], steps[:, 0]), goal.yaw)
    return np.column_stack((points, yaw))


def relaxed(field: Field, points: Array, radius: float, wanted: float, rounds: int = 40) -> Array:
    """An elastic band (Quinlan and Khatib 1993): the points (n, 2) contract and keep `wanted` metres off obstacles.

    The result is used only where it is free for a disc of `radius`; otherwise the points come back as they were.
    """
    if len(points) < 3:
        return points
    band = points.copy()
    for _ in range(rounds):
        inner = band[1:-1]
        tension = 0.5 * (band[:-2] + band[2:]) - inner
        clearance, slope = field.slopes(inner)
        push = np.clip(wanted - clearance, 0.0, None)[:, None]
        band[1:-1] = inner + 0.4 * tension + 0.3 * push * slope
    return _blended(field, band, points, radius)


def _blended(field: Field, band: Array, points: Array, radius: float) -> Array:
    """The band, but the old points around every segment of it that is not free."""
    for reach in (1, 2, 4, 8, 16):
        bad = ~_free_segments(field, band, radius)
        if not bad.any():
            return band
        near = np.convolve(bad, np.ones(2 * reach), mode="full")[reach - 1 : reach + len(points) - 1] > 0
        band = np.where(near[:, None], points, band)
    return points


def _free_segments(field: Field, points: Array, radius: float) -> npt.NDArray[np.bool_]:
    rows = points.tolist()
    return np.array([field.segment_free(a[0], a[1], b[0], b[1], radius) for a, b in pairwise(rows)], dtype=bool)
