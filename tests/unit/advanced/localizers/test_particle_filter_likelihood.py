"""Tests of the tempered likelihood field and of the border of a map."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from simscen.advanced.localizers.map_trust import MAX_WALL_THICKNESS_M, unmapped_cells
from simscen.advanced.localizers.particle_filter import UNMAPPED_LIKELIHOOD_RATIO, TemperedLikelihoodField
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import select_beams
from simscen.stack.localizers.sensor_models import LikelihoodFieldProb, obstacle_field
from simscen.testing.synthetic_room import BEAMS, cast, grid, scan

Z_HIT, Z_RAND, SIGMA = 0.5, 0.5, 0.2


@pytest.mark.parametrize(("resolution", "unknown"), [(0.1, 0.5), (0.1, 0.97), (0.3, 0.9), (1.5, 0.5), (0.1, 0.0)])
def test_map_ends_at_unknown_cells_next_to_free_cells(resolution: float, unknown: float) -> None:
    """It also ends at unknown cells more than a meter behind a wall."""
    rng = np.random.default_rng(3)
    cells = np.where(rng.random((40, 30)) < 0.5, FREE, OCCUPIED)
    cells[rng.random((40, 30)) < unknown] = UNKNOWN
    bordered = np.pad(cells, 1, constant_values=UNKNOWN)
    to_known = distance_transform_edt(bordered == UNKNOWN)
    ends = (distance_transform_edt(bordered != FREE) == to_known) | (to_known * resolution > MAX_WALL_THICKNESS_M)
    found = unmapped_cells(OccupancyGrid(cells.astype(np.int8), resolution))
    assert np.array_equal(found, (bordered == UNKNOWN) & ends)


def test_the_exponent_scales_the_log_likelihood() -> None:
    ranges = cast(np.array([Pose2(-2.5, -1.8, 0.6)]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
    beams, poses = (
        select_beams(scan(ranges), 60, -1, 100),
        np.random.default_rng(1).normal((-2.5, -1.8, 0.6), 0.2, (9, 3)),
    )
    field = obstacle_field(grid(), 2.0)
    plain = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA).log_likelihood(poses, beams, False)
    tempered = TemperedLikelihoodField(field, Z_HIT, Z_RAND, SIGMA, exponent=0.3).log_likelihood(poses, beams, False)
    assert tempered == pytest.approx(0.3 * plain, rel=1e-5)


def test_beams_that_end_in_unmapped_cells_all_have_the_same_likelihood() -> None:
    field = obstacle_field(grid(), 2.0)
    unmapped = np.ones(len(field.table), dtype=np.bool_)
    model = TemperedLikelihoodField(field, Z_HIT, Z_RAND, SIGMA, unmapped=unmapped)
    beams = select_beams(scan(np.full(BEAMS, 1.5)), 60, -1, 100)
    logarithm = model.log_likelihood(np.array([[50.0, 50.0, 0.0]]), beams, False)[0]
    expected = len(beams.ends) * np.log(UNMAPPED_LIKELIHOOD_RATIO * Z_HIT + Z_RAND / beams.range_max)
    assert logarithm == pytest.approx(expected, rel=1e-5)
