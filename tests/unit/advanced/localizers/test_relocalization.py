"""Tests of relocalization: finding the robot's pose on the map with the scans of the last meters."""

import numpy as np
import pytest

from simscen.advanced.localizers.global_search import GlobalSearch
from simscen.advanced.localizers.map_trust import MapTrust, unmapped_cells
from simscen.advanced.localizers.matched_motion import MatchedMotion
from simscen.advanced.localizers.pose_prior import ObservedMotion
from simscen.advanced.localizers.relocalization import Relocalizer
from simscen.core.environment.occupancy_grid import UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Estimate
from simscen.stack.localizers.sensor_models import obstacle_field
from simscen.testing.synthetic_room import BEAMS, cast, grid, scan

START = Pose2(-2.5, -1.8, 0.6)
ERROR = Pose2(0.4, -0.3, 0.15)


def map_around_start() -> OccupancyGrid:
    """Return a map of the corner around START, with less than half of the surfaces that are visible from START."""
    cells = grid().cells.copy()
    cells[:, grid().shape[1] * 35 // 100 :] = UNKNOWN
    cells[grid().shape[0] * 40 // 100 :] = UNKNOWN
    return OccupancyGrid(cells, grid().resolution, grid().origin)


def relocalizations(
    error: Pose2, spacing: float = 0.25, distance: float = 2.0, settling: float = 0.0, initial: Pose2 = Pose2(0, 0, 0),
    std: tuple[float, float, float] = (0.5, 0.5, 0.26), map_: OccupancyGrid | None = None, turn: float = 0.0,
) -> list[Array]:  # fmt: skip
    """Return the remaining errors after each relocalization of a robot whose belief is off by `error`.

    The robot drives `distance` m from START with a curvature `turn` in rad/m and a scan every `spacing` m. The
    relocalizer accepts poses near the initial estimate for `settling` m; `initial` and `std` are the error and the
    standard deviations of this estimate.
    """
    grid_map = map_ or grid()
    trust = MapTrust(obstacle_field(grid_map, 2.0), unmapped_cells(grid_map).ravel(), 0.45, 0.8)
    relocalizer = Relocalizer(GlobalSearch(grid_map), trust, Estimate(START.compose(initial), std), settling)
    errors = []
    for meters in np.arange(0.0, distance, spacing).tolist():
        base = (
            Pose2(meters, 0.0, 0.0)
            if not turn
            else Pose2(np.sin(turn * meters) / turn, (1 - np.cos(turn * meters)) / turn, turn * meters)
        )
        pose = START.compose(base)
        ranges = cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
        poses = relocalizer.update(scan(ranges), base, pose.compose(error), (0.0, 100.0))
        if poses is not None:
            errors.append(np.array(pose.between(Pose2(*poses[0][0].tolist()))))
    return errors


def test_wrong_pose_is_corrected_by_recent_scans() -> None:
    (offset,) = relocalizations(ERROR)
    assert np.hypot(offset[0], offset[1]) < 0.1
    assert abs(offset[2]) < 0.03


@pytest.mark.parametrize("error", [Pose2(0, 0, 0), Pose2(0.05, -0.05, 0.02)])
def test_certain_pose_is_not_corrected(error: Pose2) -> None:
    assert relocalizations(error) == []


@pytest.mark.parametrize("spacing", [0.25, 1.0], ids=["dense", "sparse"])
def test_robot_returning_to_the_map_is_relocalized(spacing: float) -> None:
    """The distance driven outside the map counts, not the number of scans."""
    offset = relocalizations(Pose2(40.0, 3.0, 0.7), spacing=spacing, distance=11.0, turn=0.5)[0]
    assert np.hypot(offset[0], offset[1]) < 0.1
    assert abs(offset[2]) < 0.03


def test_particles_return_to_the_initial_pose_if_scans_fit_there() -> None:
    """Regression: relocalization started after 1.5 m, and only for poses with a fit of 0.82."""
    offset = relocalizations(Pose2(0.9, -0.5, 0.1), distance=0.3, settling=4.0)[0]
    assert np.hypot(offset[0], offset[1]) < 0.15
    assert abs(offset[2]) < 0.05


@pytest.mark.parametrize(("error", "count"), [(Pose2(0.9, -0.5, 0.1), 1), (Pose2(0.3, 0.2, 0.05), 0)])
def test_particles_stay_at_the_initial_pose_on_a_sparse_map(error: Pose2, count: int) -> None:
    """Regression: scans with few mapped beams moved the particles by 4.9 m, against the measured motion."""
    offsets = relocalizations(error, distance=0.3, settling=4.0, map_=map_around_start())
    assert [np.abs(offset).max() < 1e-9 for offset in offsets[:1]] == [True] * count


def test_initial_pose_counts_only_for_the_settling_distance() -> None:
    assert relocalizations(Pose2(0.9, -0.5, 0.1), distance=0.3, settling=0.0) == []


def test_large_correction_needs_agreeing_searches_over_two_meters() -> None:
    """Regression: on a rebuilt floor, scans over 0.7 m matched a room 11 m away by chance."""
    error = Pose2(3.0, 2.0, 2.5)
    assert relocalizations(error, distance=3.0) == []
    (offset,) = relocalizations(error, distance=4.25)[:1]
    assert np.hypot(offset[0], offset[1]) < 0.1


@pytest.mark.parametrize(("is_detected", "is_relocalized"), [(True, True), (False, False)])
def test_detected_kidnapping_clears_the_scan_memory(is_detected: bool, is_relocalized: bool) -> None:
    """Scans from before the kidnapping would make the correct pose fit no better than others."""
    trust = MapTrust(obstacle_field(grid(), 2.0), unmapped_cells(grid()).ravel(), 0.45, 0.8)
    relocalizer, offsets = Relocalizer(GlobalSearch(grid()), trust, Estimate(START), 0.0), []
    target = Pose2(3.9, -0.2, 2.17)
    step = MatchedMotion(Pose2(0.25, 0.0, 0.0), np.diag([1e-5, 1e-5, 1e-6]))
    for k, meters in enumerate(np.concatenate((np.arange(0.0, 2.0, 0.25), 2.0 + np.arange(0.0, 3.0, 0.25))).tolist()):
        base, is_kidnapped = Pose2(meters, 0.0, 0.0), k >= 8
        pose = target.compose(Pose2(meters - 2.0, 0.0, 0.0)) if is_kidnapped else START.compose(base)
        ranges = cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
        motion = ObservedMotion(step=None if k == 8 else step, was_carried=is_detected and k == 8)
        poses = relocalizer.update(scan(ranges), base, START.compose(base), (0.0, 100.0), motion)
        if poses is not None:
            offsets.append(pose.between(Pose2(*poses[0][0].tolist())))
    assert any(np.hypot(offset.x, offset.y) < 0.1 for offset in offsets) is is_relocalized


@pytest.mark.parametrize("is_kidnapped", [True, False])
def test_kidnapped_robot_is_relocalized_with_weaker_evidence_than_off_map(is_kidnapped: bool) -> None:
    """Unmapped rooms can look like mapped ones, so relocalization outside the map needs stronger evidence."""
    trust = MapTrust(obstacle_field(grid(), 2.0), unmapped_cells(grid()).ravel(), 0.45, 0.8)
    relocalizer = Relocalizer(GlobalSearch(grid()), trust, Estimate(START), 0.0)
    error, offsets = Pose2(40.0, 3.0, 0.7), []
    for k, meters in enumerate([0.25 * k for k in range(44)]):
        base = Pose2(2 * np.sin(meters / 2), 2 * (1 - np.cos(meters / 2)), meters / 2)  # a circle
        pose = START.compose(base)
        ranges = cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
        ranges[::6] *= 0.5  # people
        motion = ObservedMotion(was_carried=is_kidnapped and k == 1)
        poses = relocalizer.update(scan(ranges), base, pose.compose(error), (0.0, 100.0), motion)
        if poses is not None:
            offsets.append(pose.between(Pose2(*poses[0][0].tolist())))
    assert [np.hypot(offset.x, offset.y) < 0.1 for offset in offsets[:1]] == [True] * is_kidnapped
