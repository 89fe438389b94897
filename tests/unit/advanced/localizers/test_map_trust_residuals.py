"""Tests of residuals between beams and map."""

import numpy as np
import pytest

from simscen.advanced.localizers.map_trust import MapResiduals, ScanResiduals
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.sensor_models import obstacle_field

WALL = 4.05
"""m: the x of the middles of a wall's cells."""
SIGMA = 0.1


def misfit(*ends: float, beyond: bool = False) -> ScanResiduals | None:
    """Of beams along x from the map's corner, which end at so many m."""
    cells = np.full((40, 60), FREE, dtype=np.int8)
    cells[:, 40] = OCCUPIED
    field = obstacle_field(OccupancyGrid(cells, 0.1, Pose2(0.0, 0.0, 0.0)), 2.0)
    says = np.full(field.table.shape, beyond)
    ranges = np.array(ends)
    beams = Beams(ranges, np.ones(len(ends), dtype=np.complex128), 0j, 10.0)
    return MapResiduals(field, says, 0.5, 0.5, SIGMA).residuals(beams, Pose2(0.0, 2.0, 0.0))


def explained(away: float) -> float:
    """The probability that a beam hit the wall, by Bayes."""
    hit = 0.5 * np.exp(-((away / SIGMA) ** 2) / 2)
    return float(hit / (hit + 0.5 / 10.0))


def test_beams_that_end_at_the_wall_have_no_residual() -> None:
    assert misfit(WALL, WALL) == pytest.approx((explained(0.0), 0.0))


@pytest.mark.parametrize("away", [0.1, 0.2])
def test_residual_is_weighted_by_the_probability_that_the_beam_hit_the_wall(away: float) -> None:
    share = explained(away)
    assert misfit(WALL - away) == pytest.approx((share, (share * away / SIGMA) ** 2), rel=1e-3)


def test_person_far_from_walls_counts_as_unexplained() -> None:
    found = misfit(WALL, 2.0)
    assert found is not None
    assert found.explained == pytest.approx(explained(0.0) / 2)
    assert found.mean_square == pytest.approx(0.0, abs=1e-9)


def test_unknown_space_gives_no_residuals() -> None:
    assert misfit(WALL, beyond=True) is None
    assert misfit(10.0) is None
