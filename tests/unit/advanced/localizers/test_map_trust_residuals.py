"""Tests of residuals between beams and map."""

import numpy as np
import pytest

from simscen.advanced.localizers.covariance_estimator import MapResiduals, ScanResiduals
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.sensor_models import obstacle_field

WALL = 4.05
"""x in m of the centers of the wall's cells."""
SIGMA = 0.1


def residuals(
    *ends: float, unmapped: bool = False, z_rand: float = 0.5, sigma_hit: float = SIGMA
) -> ScanResiduals | None:
    """Return the residuals of beams along x that end at these distances in m from the corner of the map."""
    cells = np.full((40, 60), FREE, dtype=np.int8)
    cells[:, 40] = OCCUPIED
    field = obstacle_field(OccupancyGrid(cells, 0.1, Pose2(0.0, 0.0, 0.0)), 2.0)
    is_unmapped = np.full(field.table.shape, unmapped)
    ranges = np.array(ends)
    beams = Beams(ranges, np.ones(len(ends), dtype=np.complex128), 0j, 10.0)
    return MapResiduals(field, is_unmapped, 0.5, z_rand, sigma_hit).residuals(beams, Pose2(0.0, 2.0, 0.0))


def explained(distance: float) -> float:
    """Return the posterior probability that a beam with this distance from the wall hit it."""
    hit = 0.5 * np.exp(-((distance / SIGMA) ** 2) / 2)
    return float(hit / (hit + 0.5 / 10.0))


def test_beams_that_end_at_the_wall_have_no_residual() -> None:
    assert residuals(WALL, WALL) == pytest.approx((explained(0.0), 0.0))


@pytest.mark.parametrize("distance", [0.1, 0.2])
def test_residual_is_weighted_by_the_probability_that_the_beam_hit_the_wall(distance: float) -> None:
    share = explained(distance)
    assert residuals(WALL - distance) == pytest.approx((share, (share * distance / SIGMA) ** 2), rel=1e-3)


def test_person_far_from_walls_counts_as_unexplained() -> None:
    found = residuals(WALL, 2.0)
    assert found is not None
    assert found.explained == pytest.approx(explained(0.0) / 2)
    assert found.mean_square == pytest.approx(0.0, abs=1e-9)


def test_without_random_measurements_the_map_explains_only_beams_near_walls() -> None:
    found = residuals(WALL, 2.0, z_rand=0.0, sigma_hit=0.02)
    assert found == pytest.approx((0.5, 0.0))


def test_unknown_space_gives_no_residuals() -> None:
    assert residuals(WALL, unmapped=True) is None
    assert residuals(10.0) is None
