"""Tests of the residuals of beams: their distances from the mapped walls, weighted by the probability of a hit."""

import numpy as np
import pytest

from simscen.advanced.localizers.covariance_estimator import MapResiduals, ScanResiduals
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.sensor_models import obstacle_field

WALL_X_M = 4.05
"""Centers of the cells of the wall."""
SIGMA = 0.1


def residuals(
    *ends: float, unmapped: bool = False, z_rand: float = 0.5, sigma_hit: float = SIGMA
) -> ScanResiduals | None:
    """Return the residuals of beams along x from (0, 2) with these ranges in m."""
    cells = np.full((40, 60), FREE, dtype=np.int8)
    cells[:, 40] = OCCUPIED
    field = obstacle_field(OccupancyGrid(cells, 0.1, Pose2(0.0, 0.0, 0.0)), 2.0)
    is_unmapped = np.full(field.table.shape, unmapped)
    ranges = np.array(ends)
    beams = Beams(ranges, np.ones(len(ends), dtype=np.complex128), 0j, 10.0)
    return MapResiduals(field, is_unmapped, 0.5, z_rand, sigma_hit).residuals(beams, Pose2(0.0, 2.0, 0.0))


def hit_probability(distance: float) -> float:
    """Return the posterior probability that a beam that ends at this distance from the wall has hit the wall."""
    hit = 0.5 * np.exp(-((distance / SIGMA) ** 2) / 2)
    return float(hit / (hit + 0.5 / 10.0))


def test_beams_that_end_at_the_wall_have_no_residual() -> None:
    assert residuals(WALL_X_M, WALL_X_M) == pytest.approx((hit_probability(0.0), 0.0))


@pytest.mark.parametrize("distance", [0.1, 0.2])
def test_residual_is_weighted_by_the_probability_that_the_beam_hit_the_wall(distance: float) -> None:
    probability = hit_probability(distance)
    assert residuals(WALL_X_M - distance) == pytest.approx(
        (probability, (probability * distance / SIGMA) ** 2), rel=1e-3
    )


def test_person_far_from_walls_counts_as_unexplained() -> None:
    result = residuals(WALL_X_M, 2.0)
    assert result is not None
    assert result.explained == pytest.approx(hit_probability(0.0) / 2)
    assert result.mean_square == pytest.approx(0.0, abs=1e-9)


def test_without_random_measurements_the_map_explains_only_beams_near_walls() -> None:
    result = residuals(WALL_X_M, 2.0, z_rand=0.0, sigma_hit=0.02)
    assert result == pytest.approx((0.5, 0.0))


def test_unknown_space_gives_no_residuals() -> None:
    assert residuals(WALL_X_M, unmapped=True) is None
    assert residuals(10.0) is None
