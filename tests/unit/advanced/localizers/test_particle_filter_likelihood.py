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


@pytest.mark.parametrize(("resolution", "unknown_share"), [(0.1, 0.5), (0.1, 0.97), (0.3, 0.9), (1.5, 0.5), (0.1, 0.0)])
def test_unknown_cells_next_to_free_cells_or_far_behind_walls_are_unmapped(
    resolution: float, unknown_share: float
) -> None:
    """Unknown cells within a wall or close behind it belong to the wall."""
    rng = np.random.default_rng(3)
    cells = np.where(rng.random((40, 30)) < 0.5, FREE, OCCUPIED)
    cells[rng.random((40, 30)) < unknown_share] = UNKNOWN
    bordered = np.pad(cells, 1, constant_values=UNKNOWN)
    known_distance = distance_transform_edt(bordered == UNKNOWN)
    is_outside = (distance_transform_edt(bordered != FREE) == known_distance) | (
        known_distance * resolution > MAX_WALL_THICKNESS_M
    )
    unmapped = unmapped_cells(OccupancyGrid(cells.astype(np.int8), resolution))
    assert np.array_equal(unmapped, (bordered == UNKNOWN) & is_outside)


def test_the_exponent_scales_the_log_likelihood() -> None:
    ranges = cast(np.array([Pose2(-2.5, -1.8, 0.6)]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0]
    beams, poses = (
        select_beams(scan(ranges), 60, -1, 100),
        np.random.default_rng(1).normal((-2.5, -1.8, 0.6), 0.2, (9, 3)),
    )
    field = obstacle_field(grid(), 2.0)
    untempered = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA).log_likelihood(poses, beams, False)
    tempered = TemperedLikelihoodField(field, Z_HIT, Z_RAND, SIGMA, exponent=0.3).log_likelihood(poses, beams, False)
    assert tempered == pytest.approx(0.3 * untempered, rel=1e-5)


def test_beams_that_end_in_unmapped_cells_all_have_the_same_likelihood() -> None:
    field = obstacle_field(grid(), 2.0)
    unmapped = np.ones(len(field.table), dtype=np.bool_)
    model = TemperedLikelihoodField(field, Z_HIT, Z_RAND, SIGMA, unmapped=unmapped)
    beams = select_beams(scan(np.full(BEAMS, 1.5)), 60, -1, 100)
    log_likelihood = model.log_likelihood(np.array([[50.0, 50.0, 0.0]]), beams, False)[0]
    expected = len(beams.ends) * np.log(UNMAPPED_LIKELIHOOD_RATIO * Z_HIT + Z_RAND / beams.range_max)
    assert log_likelihood == pytest.approx(expected, rel=1e-5)
