"""Tests of generated logs: they are reproducible and realistic, and AMCL localizes the robot in them."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from simscen.advanced.spec import ScanMatchingAmcl
from simscen.bench.localization.buildings import box_distances, generate_building, wall_boxes
from simscen.bench.localization.campaign import CHECK_TIMES_S, PARAMETER_SETS, ROBOT, SuccessRate, Trial, summarize
from simscen.bench.localization.generated_logs import Log, generate_log
from simscen.bench.localization.log_evaluation import compare_with_reference, localize
from simscen.core.environment.occupancy_grid import FREE, UNKNOWN
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.model.stack import StackSpec
from simscen.record.localization_logs.rows import TICK_RATE_HZ
from simscen.stack.protocols import Surroundings


@cache
def short_log(circumstance: str) -> Log:
    """Return a log of 15 s of the first drive in building 2001, in a circumstance of CIRCUMSTANCES."""
    return generate_log(2001, 1, circumstance, seconds=15.0)


def test_a_wall_has_its_openings() -> None:
    assert wall_boxes((0, 1), (5, 1), 0.2, [(1, 2)]).tolist() == [[0, 0.9, 1, 1.1], [2, 0.9, 5, 1.1]]
    assert wall_boxes((1, 0), (1, 2), 0.2).tolist() == [[0.9, 0, 1.1, 2]]


def test_rebuilt_floor_differs_only_right_of_the_center() -> None:
    floor, regenerated, rebuilt = generate_building(2001), generate_building(2001), generate_building(2001, 1)
    assert floor.size[0] > 40
    assert np.array_equal(floor.furniture, regenerated.furniture)
    left_furniture = {tuple(row) for row in floor.furniture.tolist() if row[2] < floor.middle}
    assert left_furniture <= {tuple(row) for row in rebuilt.furniture.tolist()}
    assert not np.array_equal(floor.furniture, rebuilt.furniture)


def test_generated_log_is_reproducible_collision_free_and_has_odometry_drift() -> None:
    first, second = short_log("tracked"), generate_log(2001, 1, "tracked", seconds=15.0)
    assert np.array_equal(first.recording.truth, second.recording.truth)
    assert (
        min(
            box_distances(generate_building(2001).walls, pose[:2]).min()
            for pose in first.recording.truth[::20].tolist()
        )
        > 0.25
    )
    scans = [reading for reading in first.recording.readings if isinstance(reading, Scan)]
    assert {len(reading.ranges) for reading in scans} == {361}
    odometry = [reading.pose for reading in first.recording.readings if isinstance(reading, Odometry)]
    truth = first.recording.truth
    true_length = np.hypot(*np.diff(truth[:, :2], axis=0).T).sum()
    odometry_length = sum(a.distance(b) for a, b in pairwise(odometry))
    assert 0.002 < abs(odometry_length / true_length - 1) < 0.3


def test_half_map_is_unknown_right_of_the_center() -> None:
    half_map, whole_map = short_log("half").map, short_log("tracked").map
    column = int((generate_building(2001).middle - half_map.origin.x) / half_map.resolution)
    assert (half_map.cells[:, column:] == UNKNOWN).all()
    assert np.array_equal(half_map.cells[:, :column], whole_map.cells[:, :column])
    assert (whole_map.cells == FREE).mean() > 0.5


@pytest.mark.sample(1)
@pytest.mark.parametrize("circumstance", ["tracked", "unknown"])
@pytest.mark.parametrize("parameters", ["default", "consistent"])
def test_a_robot_is_tracked_with_raw_odometry_and_found_on_a_floor_of_forty_meters(
    circumstance: str, parameters: str
) -> None:
    log = short_log(circumstance)
    spec = StackSpec(localizer=ScanMatchingAmcl.model_validate({"parameters": parameters}))
    localized = localize(log.recording, spec, Surroundings(ROBOT, log.map, TICK_RATE_HZ), log.estimate, 1)
    errors = compare_with_reference(localized, log.recording, 1.0)
    assert errors is not None
    assert errors.distance[-40:].max() < 0.3
    assert circumstance == "unknown" or not errors.lost


def test_summary_counts_robots_that_were_tracked_or_found_in_time() -> None:
    def trial(number: int, circumstance: str, tracked: bool, found: float | None) -> Trial:
        return Trial(number, 0, circumstance, tracked, 0.05 * number, 1.0, found, (3.0,) * len(CHECK_TIMES_S), 1.0, 2.0)

    trials = [trial(n, c, n != 2, 30.0 * n) for n in (1, 2, 3) for c in ("tracked", "clean", "slipping", "unknown")]
    row = summarize("some", [*trials, trial(1, "kidnapped", False, None), trial(1, "outdated", True, 0.0)])
    assert row.shares["tracked"] == SuccessRate(2, 3, None)
    assert row.shares["unknown"].count == 2
    assert row.shares["kidnapped"] == SuccessRate(0, 1, None)
    assert row.median == pytest.approx(0.1)
    clean = row.consistency["clean"]
    assert clean.anees_by_time == [3.0] * len(CHECK_TIMES_S)
    assert (clean.anees, clean.bounds, clean.inside) == (3.0, (3.0, 3.0), 1.0)
    assert row.consistency["outdated"].bounds is None
    assert "half" not in row.consistency
    assert set(PARAMETER_SETS) >= {"amcl", "scan_matching_amcl", "scan_matching_amcl, consistent"}
