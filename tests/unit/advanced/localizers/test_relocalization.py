"""Tests of relocalization by recent scans."""

import numpy as np
import pytest

from simscen.advanced.localizers.global_search import GlobalSearch
from simscen.advanced.localizers.map_trust import MapTrust
from simscen.advanced.localizers.particle_filter import unmapped_cells
from simscen.advanced.localizers.pose_prior import ObservedMotion
from simscen.advanced.localizers.relocalization import Relocalizer
from simscen.advanced.localizers.scan_matcher import Step
from simscen.core.environment.occupancy_grid import UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Estimate
from simscen.stack.localizers.sensor_models import obstacle_field
from simscen.testing.synthetic_room import BEAMS, cast, grid, scan

START = Pose2(-2.5, -1.8, 0.6)
OFF = Pose2(0.4, -0.3, 0.15)


def corner_of_the_map() -> OccupancyGrid:
    """The room only around START: of what is seen there the map shows less than half."""
    cells = grid().cells.copy()
    cells[:, grid().shape[1] * 35 // 100 :] = UNKNOWN
    cells[grid().shape[0] * 40 // 100 :] = UNKNOWN
    return OccupancyGrid(cells, grid().resolution, grid().origin)


def found(
    off: Pose2, apart: float = 0.25, way: float = 2.0, settling: float = 0.0, estimated: Pose2 = Pose2(0, 0, 0),
    std: tuple[float, float, float] = (0.5, 0.5, 0.26), map_: OccupancyGrid | None = None, turn: float = 0.0,
) -> list[Array]:  # fmt: skip
    """Return where a robot is put that believes to be `off`.

    It starts at START and drives some `way` with a curvature `turn` (rad/m), with scans so many m `apart`. It was
    `estimated` to be that far off, with standard deviations `std`.
    """
    known = map_ or grid()
    trust = MapTrust(obstacle_field(known, 2.0), unmapped_cells(known).ravel(), 0.45, 0.8)
    finder, places = Relocalizer(GlobalSearch(known), trust, Estimate(START.compose(estimated), std), settling), []
    for driven in np.arange(0.0, way, apart).tolist():
        base = (
            Pose2(driven, 0.0, 0.0)
            if not turn
            else Pose2(np.sin(turn * driven) / turn, (1 - np.cos(turn * driven)) / turn, turn * driven)
        )
        pose = START.compose(base)
        ranges = cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
        put = finder.update(scan(ranges), base, pose.compose(off), (0.0, 100.0))
        if put is not None:
            places.append(np.array(pose.between(Pose2(*put[0][0].tolist()))))
    return places


def test_wrong_pose_is_corrected_by_recent_scans() -> None:
    (place,) = found(OFF)
    assert np.hypot(place[0], place[1]) < 0.1
    assert abs(place[2]) < 0.03


@pytest.mark.parametrize("off", [Pose2(0, 0, 0), Pose2(0.05, -0.05, 0.02)])
def test_certain_pose_is_not_corrected(off: Pose2) -> None:
    assert found(off) == []


@pytest.mark.parametrize("apart", [0.25, 1.0], ids=["dense", "sparse"])
def test_robot_returning_to_the_map_is_relocalized(apart: float) -> None:
    """The distance driven outside the map counts, not the number of scans."""
    place = found(Pose2(40.0, 3.0, 0.7), apart=apart, way=11.0, turn=0.5)[0]
    assert np.hypot(place[0], place[1]) < 0.1
    assert abs(place[2]) < 0.03


def test_particles_return_to_the_initial_pose_if_scans_fit_there() -> None:
    """Until 1.5 m were driven nobody asked, and then only for a place that fits 0.82."""
    place = found(Pose2(0.9, -0.5, 0.1), way=0.3, settling=4.0)[0]
    assert np.hypot(place[0], place[1]) < 0.15
    assert abs(place[2]) < 0.05


@pytest.mark.parametrize(("off", "places"), [(Pose2(0.9, -0.5, 0.1), 1), (Pose2(0.3, 0.2, 0.05), 0)])
def test_particles_stay_at_the_initial_pose_on_a_sparse_map(off: Pose2, places: int) -> None:
    """Regression: few mapped beams moved the particles by 4.9 m, although scan matching measured the motion."""
    put = found(off, way=0.3, settling=4.0, map_=corner_of_the_map())
    assert [np.abs(place).max() < 1e-9 for place in put[:1]] == [True] * places


def test_initial_pose_counts_only_for_the_settling_distance() -> None:
    assert found(Pose2(0.9, -0.5, 0.1), way=0.3, settling=0.0) == []


def test_large_correction_needs_agreeing_searches_over_two_meters() -> None:
    """Regression: on a rebuilt floor, scans over 0.7 m matched a room 11 m away by chance."""
    away = Pose2(3.0, 2.0, 2.5)
    assert found(away, way=3.0) == []
    (place,) = found(away, way=4.25)[:1]
    assert np.hypot(place[0], place[1]) < 0.1


@pytest.mark.parametrize(("parted", "found_again"), [(True, True), (False, False)])
def test_detected_kidnapping_clears_the_scan_memory(parted: bool, found_again: bool) -> None:
    """Scans from before the kidnapping would make the correct pose fit no better than others."""
    trust = MapTrust(obstacle_field(grid(), 2.0), unmapped_cells(grid()).ravel(), 0.45, 0.8)
    finder, there, puts = Relocalizer(GlobalSearch(grid()), trust, Estimate(START), 0.0), Pose2(3.9, -0.2, 2.17), []
    step = Step(Pose2(0.25, 0.0, 0.0), np.diag([1e-5, 1e-5, 1e-6]))
    for k, driven in enumerate(np.concatenate((np.arange(0.0, 2.0, 0.25), 2.0 + np.arange(0.0, 3.0, 0.25))).tolist()):
        base, carried = Pose2(driven, 0.0, 0.0), k >= 8
        pose = there.compose(Pose2(driven - 2.0, 0.0, 0.0)) if carried else START.compose(base)
        ranges = cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
        way = ObservedMotion(step=None if k == 8 else step, was_carried=parted and k == 8)
        put = finder.update(scan(ranges), base, START.compose(base), (0.0, 100.0), way)
        if put is not None:
            puts.append(pose.between(Pose2(*put[0][0].tolist())))
    assert any(np.hypot(off.x, off.y) < 0.1 for off in puts) is found_again


@pytest.mark.parametrize("carried_off", [True, False])
def test_kidnapped_robot_is_relocalized_with_weaker_evidence_than_off_map(carried_off: bool) -> None:
    """Unmapped rooms look like mapped ones, so a robot that left the map needs stronger evidence."""
    trust = MapTrust(obstacle_field(grid(), 2.0), unmapped_cells(grid()).ravel(), 0.45, 0.8)
    finder, away, puts = Relocalizer(GlobalSearch(grid()), trust, Estimate(START), 0.0), Pose2(40.0, 3.0, 0.7), []
    for k, driven in enumerate([0.25 * k for k in range(44)]):
        base = Pose2(2 * np.sin(driven / 2), 2 * (1 - np.cos(driven / 2)), driven / 2)  # a circle
        pose = START.compose(base)
        ranges = cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
        ranges[::6] *= 0.5  # people
        way = ObservedMotion(was_carried=carried_off and k == 1)
        put = finder.update(scan(ranges), base, pose.compose(away), (0.0, 100.0), way)
        if put is not None:
            puts.append(pose.between(Pose2(*put[0][0].tolist())))
    assert [np.hypot(off.x, off.y) < 0.1 for off in puts[:1]] == [True] * carried_off
