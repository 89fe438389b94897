"""From a jagged tree path to one a robot likes: shorter, away from walls, evenly spaced, with headings."""

import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.planners.field import Field
from simscen.stack.planners.search import Point

SPACING = 0.05
"""Metres between the points of a finished path."""


def pull_tight(field: Field, points: list[Point], radius: float) -> list[Point]:
    """String pulling: from each kept point go straight to the farthest point that can be seen."""
    pulled, at = [points[0]], 0
    while at < len(points) - 1:
        ahead = len(points) - 1
        while ahead > at + 1 and not field.segment_free(*points[at], *points[ahead], radius):
            ahead -= 1
        pulled.append(points[ahead])
        at = ahead
    return pulled


def spaced(points: Array, spacing: float) -> Array:
    """The polyline (n, 2) resampled at most `spacing` metres apart, both ends kept."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    along = np.concatenate(([0.0], np.cumsum(steps)))
    count = max(2, math.ceil(along[-1] / spacing) + 1)
    places = np.linspace(0.0, along[-1], count)
    return np.column_stack((np.interp(places, along, points[:, 0]), np.interp(places, along, points[:, 1])))


def with_headings(points: Array, goal: Pose2) -> Array:
    """Poses (n, 3): each point heads to the next, the last one as the goal does."""
    steps = np.diff(points, axis=0)
    yaw = np.append(np.arctan2(steps[:, 1], steps[:, 0]), goal.yaw)
    return np.column_stack((points, yaw))


def relaxed(field: Field, points: Array, radius: float, wanted: float, rounds: int = 60) -> Array:
    """An elastic band (Quinlan and Khatib 1993): the points (n, 2) contract and keep `wanted` metres off obstacles.

    The result is used only where it is free for a disc of `radius`; otherwise the points come back as they were.
    """
    if len(points) < 3:
        return points
    band = points.copy()
    h = field.resolution
    for _ in range(rounds):
        inner = band[1:-1]
        tension = 0.5 * (band[:-2] + band[2:]) - inner
        clearance = field.many(inner)
        push = np.clip(wanted - clearance, 0.0, None)[:, None]
        slope = np.column_stack(
            (
                field.many(inner + (h, 0.0)) - field.many(inner - (h, 0.0)),
                field.many(inner + (0.0, h)) - field.many(inner - (0.0, h)),
            )
        ) / (2 * h)
        band[1:-1] = inner + 0.4 * tension + 0.3 * push * np.clip(slope, -1, 1)
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
