"""Tests of the geometry of marking and clearing: crossed cells, visible cells, hits, and blind scans."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Costmap as Spec
from simscen.stack.costmap import costmaps
from simscen.stack.costmap.grid_frame import GridFrame
from simscen.stack.costmap.obstacle_layer import crossed_cells, hit_points, in_view

FRAME = GridFrame((-4.0, -4.0), 0.05, (160, 160))


def cells_along_beams(scan: Scan, base: Pose2, spec: Spec) -> set[tuple[int, int]]:
    """Return the cells that the beams cross, found by steps of 1 mm along each beam."""
    lidar = base.compose(scan.mount)
    cells: set[tuple[int, int]] = set()
    for angle, length in zip(scan.angles() + lidar.yaw, scan.ranges, strict=True):
        distances = np.arange(0.0, min(length, spec.raytrace_max_range), 0.001)
        points = np.column_stack((lidar.x + distances * math.cos(angle), lidar.y + distances * math.sin(angle)))
        cells |= set(map(tuple, FRAME.cells(points).tolist()))
    return cells


@pytest.mark.parametrize("beams", [36, 720])
def test_crossed_cells_equal_those_of_fine_steps_along_the_beams(beams: int) -> None:
    spec, base = Spec(), Pose2(0.31, -0.22, 0.7)
    step = 2 * math.pi / beams
    scan = Scan("l", 0, 2.0 + np.sin(3 * np.arange(beams) * step), -math.pi, step, 0.05, 12.0, Pose2(0.1, 0.05, 0.2))
    cells = np.argwhere(np.ones(FRAME.shape, dtype=bool))
    centers = FRAME.points(np.arange(len(cells)))
    found = {tuple(cell) for cell in cells[crossed_cells(centers, FRAME.resolution, scan, base, spec)[0]].tolist()}
    expected = cells_along_beams(scan, base, spec)
    points, _ = hit_points(scan, base, 0.0, 99.0)
    ends = {tuple(cell) for cell in FRAME.cells(np.column_stack((points.real, points.imag))).tolist()}
    # Cells at the end of a beam may differ, as marking follows clearing. Near the lidar, many beams share a cell.
    lidar = base.compose(scan.mount)
    distant = {c for c in expected if np.hypot(*(FRAME.centers(np.array([c]))[0] - lidar[:2])) > 0.3}
    assert len(found - expected) <= 0.01 * len(expected)
    missed = {c for c in distant - found if all(max(abs(c[0] - e[0]), abs(c[1] - e[1])) > 1 for e in ends)}
    assert len(missed) <= 0.03 * len(distant)


@pytest.mark.parametrize("beams", [200, 271])
def test_lidar_with_clockwise_beams_sees_the_same_cells(beams: int) -> None:
    spec, base, edge = Spec(), Pose2(0.31, -0.22, 0.7), math.radians(135)
    step, ranges = 2 * edge / (beams - 1), 2.0 + np.sin(0.1 * np.arange(beams))
    scan = Scan("l", 0, ranges, -edge, step, 0.05, 12.0, Pose2(0.1, 0.05, 0.2))
    clockwise = replace(scan, ranges=ranges[::-1], angle_min=edge, angle_increment=-step)
    cells = np.argwhere(np.ones(FRAME.shape, dtype=bool))
    x, y = base.compose(scan.mount).inverse().apply(FRAME.centers(cells)).T
    bearing = np.abs(np.arctan2(y, x))
    for lidar_scan in (scan, clockwise):
        is_seen = in_view(cells, FRAME, lidar_scan, base)
        assert is_seen[bearing < edge + 0.49 * step].all()
        assert not is_seen[bearing > edge + 0.51 * step].any()
    centers = FRAME.points(np.arange(len(cells)))
    crossed, crossed_clockwise = (
        crossed_cells(centers, FRAME.resolution, lidar_scan, base, spec)[0] for lidar_scan in (scan, clockwise)
    )
    assert len(crossed) > 1000
    # Only cells at the edge of the first beam differ.
    assert len(np.setxor1d(crossed, crossed_clockwise)) <= 0.01 * len(crossed)


def test_hit_points_are_in_the_map_frame() -> None:
    ranges = np.array([1.0, np.inf, np.nan, 2.0, 9.0, -np.inf])
    scan = Scan("l", 0, ranges, 0.0, math.pi / 2, 0.05, 12.0, Pose2(0.1, 0, 0))
    points, _ = hit_points(scan, Pose2(1.0, 1.0, math.pi / 2), 0.0, 2.5)
    assert points == pytest.approx(np.array([1.0 + 2.1j, 3.0 + 1.1j]))


@pytest.mark.parametrize(
    ("ranges", "is_blind"),
    [([], True), ([np.nan, -np.inf, 0.01], True), ([np.nan, np.inf], False), ([-np.inf, 3.0], False)],
)
def test_a_scan_without_free_space_or_hits_is_blind(ranges: list[float], is_blind: bool) -> None:
    assert costmaps._is_blind(Scan("l", 0, np.array(ranges), 0.0, 0.1, 0.05, 12.0)) is is_blind
