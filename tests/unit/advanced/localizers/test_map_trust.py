"""Tests of map trust: the weight of a scan, and beams that end outside the map."""

import numpy as np
import pytest
from pydantic import ValidationError

from simscen.advanced.localizers.map_trust import MapTrust, unmapped_cells
from simscen.advanced.spec import ScanMatchingAmcl
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.beams import Beams, ComplexPoints
from simscen.stack.localizers.particles import Particles
from simscen.stack.localizers.sensor_models import obstacle_field

CONCENTRATED = np.array([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]])
"""Poses of particles in the middle of the map."""
SPREAD = np.array([[-2.0, 0.0, 0.0], [2.0, 0.0, 0.1], [0.0, 0.5, -0.1]])


def trust() -> MapTrust:
    """Return the map trust of a hall of 20 x 4 m with walls at y = ±2 m; both ends are open to unknown space."""
    cells = np.full((120, 800), UNKNOWN, dtype=np.int8)
    cells[20:100, 200:600] = FREE
    cells[[20, 99], 200:600] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, Pose2(-20.0, -3.0, 0.0))
    return MapTrust(obstacle_field(grid, 2.0), unmapped_cells(grid).ravel(), 0.45, 0.8)


def beams_to(ends: ComplexPoints) -> Beams:
    """Return the beams of a lidar at the origin of the base."""
    return Beams(np.abs(ends), ends / np.abs(ends), 0j, 30.0)


def scan_weight(poses: Array, on_walls: int, in_free_space: int, off_map: int) -> tuple[float, list[bool] | None]:
    """Return the weight of a scan with these numbers of beams, and which of its beams are compared."""
    walls = np.linspace(-1.0, 1.0, on_walls) + 1.9j
    ends = np.concatenate((walls, np.full(in_free_space, 2.0 + 0.0j), np.full(off_map, 14.0 + 0.0j)))
    exponent, _, is_compared = trust().weight(Particles.with_equal_weights(poses), beams_to(ends))
    return exponent, None if is_compared is None else is_compared.tolist()


def test_scan_that_fits_the_map_has_full_weight() -> None:
    assert scan_weight(CONCENTRATED, 20, 0, 0) == (1.0, None)


@pytest.mark.parametrize(("on_walls", "in_free_space", "weight"), [(17, 3, 1.0), (12, 8, 3 / 7), (8, 12, 0.0)])
def test_scan_with_few_fitting_beams_has_less_weight(on_walls: int, in_free_space: int, weight: float) -> None:
    assert scan_weight(CONCENTRATED, on_walls, in_free_space, 0)[0] == pytest.approx(weight, abs=1e-9)


@pytest.mark.parametrize("poses", [CONCENTRATED, SPREAD])
def test_scan_with_few_beams_on_the_map_has_no_weight(poses: Array) -> None:
    """Regression: the scan had its full weight, and moved particles from unknown rooms back into the map."""
    assert scan_weight(poses, 2, 0, 30)[0] == 0.0


def test_partly_mapped_scan_has_partial_weight() -> None:
    exponent, _ = scan_weight(CONCENTRATED, 10, 0, 10)
    assert exponent == pytest.approx(4 / 7, abs=1e-9)


def test_beams_that_leave_the_map_are_not_compared() -> None:
    assert scan_weight(CONCENTRATED, 2, 1, 1)[1] == [True, True, True, False]


def test_beams_without_a_hit_are_kept_if_others_are_excluded() -> None:
    beams = Beams(np.array([1.0, 9.0, 2.0, 3.0]), np.ones(4, dtype=np.complex128), 0j, 9.0)
    kept = beams.with_hits(np.array([True, False, True]))
    assert kept.ranges.tolist() == [1.0, 9.0, 3.0]
    assert kept.ends.tolist() == [1.0, 3.0]


@pytest.mark.parametrize("count", [500, 700])
def test_map_trust_uses_a_sample_of_many_particles(count: int) -> None:
    """With and without known beam ends for all particles."""
    rng = np.random.default_rng(3)
    poses = rng.normal((0.0, 0.0, 0.0), (0.1, 0.1, 0.02), (count, 3))
    beams, sampled_poses = beams_to(np.linspace(-1.0, 3.0, 40) + 1.9j), poses[:: -(-count // 50)]
    weight, sampled = (
        trust().weight(Particles.with_equal_weights(poses), beams),
        trust().weight(Particles.with_equal_weights(sampled_poses), beams),
    )
    assert 0.0 < weight.fitting_share < 1.0
    assert (weight.exponent, weight.fitting_share) == (sampled.exponent, sampled.fitting_share)


def test_beam_ends_are_computed_for_the_requested_poses() -> None:
    grid = OccupancyGrid(np.full((80, 80), FREE, dtype=np.int8), 0.1, Pose2(-4.0, -4.0, 0.0))
    field, beams = obstacle_field(grid, 2.0), beams_to(np.array([1.0 + 1.0j, -2.0 + 0.3j]))
    origin, shifted = np.zeros((1, 3)), np.array([[0.5, 0.0, 0.0]])
    for poses, expected_cell in ((origin, (50, 50)), (shifted, (55, 50)), (origin, (50, 50)), (shifted, (55, 50))):
        column, row = expected_cell
        assert beams.cells(field, poses)[0, 0] == (row + 1) * 82 + column + 1


@pytest.mark.parametrize("values", [{"map_trust_none": 0.8}, {"map_trust_none": 0.9}, {"map_trust_full": 0.3}])
def test_limits_of_the_map_trust_are_in_order(values: dict[str, float]) -> None:
    with pytest.raises(ValidationError, match="map_trust_none"):
        ScanMatchingAmcl.model_validate(values)


def test_map_trust_can_be_turned_off() -> None:
    assert ScanMatchingAmcl.model_validate({"map_trust_full": 0}).map_trust_full == 0.0
