"""Tests of the beam model: ray casting, and the likelihood of Table 6.1 of Probabilistic Robotics."""

import math

import numpy as np
import pytest

from simscen.core.environment.occupancy_grid import FREE, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import select_beams
from simscen.stack.localizers.sensor_models import BeamModel, cast_rays, opaque_field
from simscen.testing.synthetic_room import BEAMS, cast, drive, grid, scan

MOUNT = Pose2(0.15, -0.1, 0.5)


def range_by_steps(room: OccupancyGrid, pose: Pose2, angle: float, limit: float) -> float:
    """Return the distance to the first cell that is not free, found by steps of 1 mm along a ray."""
    distances = np.arange(0, limit, 0.001)
    points = np.column_stack((pose.x + distances * math.cos(angle), pose.y + distances * math.sin(angle)))
    hit = np.flatnonzero(room.values_at(points) != FREE)
    return float(distances[hit[0]]) if len(hit) else limit


@pytest.mark.parametrize("limit", [12.0, 2.0])
def test_cast_rays_equal_steps_of_a_millimeter(limit: float) -> None:
    field = opaque_field(grid(), 100.0)
    beams = select_beams(scan(np.full(BEAMS, 1.0), mount=MOUNT), 40, -1, limit)
    poses = drive(60.0).truth[::400]
    ranges = cast_rays(field, poses, beams)
    for pose, row in zip(poses, ranges, strict=True):
        lidar = Pose2(*pose).compose(MOUNT)
        exact = [range_by_steps(grid(), lidar, pose[2] + bearing, limit) for bearing in beams.bearings]
        # A few rays that graze a corner may differ by more than half a cell.
        assert np.quantile(np.abs(row - exact), 0.97) <= 0.5 * 0.05 + 1e-3


def test_rays_end_at_unknown_cells_and_at_the_border_of_the_map() -> None:
    cells = np.full((10, 20), FREE, dtype=np.int8)
    cells[:, 15:] = UNKNOWN
    field = opaque_field(OccupancyGrid(cells, 0.1), 100.0)
    beams = select_beams(scan(np.full(4, 1.0)), 60, -1, 100)
    backward, right, forward, left = cast_rays(field, np.array([[0.55, 0.35, 0.0]]), beams)[0]
    assert [backward, right, forward, left] == pytest.approx([0.55, 0.35, 0.95, 0.65], abs=0.051)


def test_particle_outside_the_map_has_zero_ranges() -> None:
    beams = select_beams(scan(np.full(4, 1.0)), 60, -1, 100)
    assert (cast_rays(opaque_field(grid(), 100.0), np.array([[50.0, 1e6, 0.0]]), beams) == 0).all()


def test_likelihood_equals_the_mixture_of_the_four_cases_computed_by_hand() -> None:
    model = BeamModel(opaque_field(grid(), 100.0), 0.5, 0.05, 0.05, 0.5, 0.2, 0.1)
    pose = np.array([[-2.5, -1.8, 0.6]])
    ranges = cast(pose, -np.pi + np.pi / 180 * np.arange(BEAMS))[0]
    ranges[::24], ranges[6::24], ranges[12::24] = np.inf, 0.3, np.nan
    beams = select_beams(scan(ranges), 60, -1, 100)
    total = 1.0
    for measured, expected in zip(beams.ranges, cast_rays(model.field, pose, beams)[0], strict=True):
        p = 0.5 * math.exp(-((measured - expected) ** 2) / (2 * 0.2**2))
        p += 0.05 * 0.1 * math.exp(-0.1 * measured) if measured < expected else 0
        p += 0.05 if measured == 12 else 0.5 / 12
        total += p**3
    assert len(beams.ranges) == 45
    assert model.log_likelihood(pose, beams, False) == pytest.approx([math.log(total)])
