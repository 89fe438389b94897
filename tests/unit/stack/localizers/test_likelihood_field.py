"""Tests of the likelihood fields against the formulas of nav2_amcl."""

import math

import numpy as np
import pytest

from simscen.core.environment.occupancy_grid import OCCUPIED, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import Beams, select_beams
from simscen.stack.localizers.sensor_models import (
    BeamSkipping,
    LikelihoodField,
    LikelihoodFieldProb,
    obstacle_field,
    surfaces,
)
from simscen.testing.synthetic_room import BEAMS, cast, grid, scan

Z_HIT, Z_RAND, SIGMA = 0.5, 0.5, 0.2
POSE = Pose2(-2.5, -1.8, 0.6)


def beams_at(pose: Pose2, mount: Pose2 = Pose2(0.1, 0.05, 0.3)) -> Beams:
    angles = -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS)
    return select_beams(scan(cast(np.array([pose]), angles)[0], mount=mount), 60, -1, 100)


def probabilities(room: OccupancyGrid, pose: Pose2, beams: Beams) -> list[float]:
    """Return the probability of each beam by Table 6.3 of Probabilistic Robotics, with distances by brute force."""
    centers = room.center_of(np.argwhere(surfaces(room.cells == OCCUPIED)))
    result = []
    for end in pose.apply(beams.ends.view(np.float64).reshape(-1, 2)):
        cell = room.cell_of(end[None])
        distance = 2.0
        if room.inside(cell)[0]:
            distance = min(2.0, float(np.hypot(*(centers - room.center_of(cell)).T).min()))
        result.append(Z_HIT * math.exp(-(distance**2) / (2 * SIGMA**2)) + Z_RAND / beams.range_max)
    return result


@pytest.mark.parametrize("map_yaw", [0.0, 0.7])
def test_both_models_equal_the_formulas_for_each_beam(map_yaw: float) -> None:
    room = OccupancyGrid(grid().cells, 0.05, Pose2(*grid().origin[:2], map_yaw))
    field, beams = obstacle_field(room, 2.0), beams_at(POSE)
    poses = np.random.default_rng(4).normal(POSE, (1.5, 1.5, 1.0), (6, 3))
    expected = [probabilities(room, Pose2(*pose), beams) for pose in poses]
    cubes = LikelihoodField(field, Z_HIT, Z_RAND, SIGMA).log_likelihood(poses, beams, False)
    product = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA).log_likelihood(poses, beams, False)
    assert np.exp(cubes) == pytest.approx([1 + sum(p**3 for p in ps) for ps in expected], rel=1e-4)
    assert product == pytest.approx([sum(map(math.log, ps)) for ps in expected], rel=1e-4)


def test_the_true_pose_is_likelier_than_poses_around_it() -> None:
    field, beams = obstacle_field(grid(), 2.0), beams_at(POSE, mount=Pose2(0, 0, 0))
    steps = [(dx, dy, turn) for dx in (-0.3, 0, 0.3) for dy in (-0.3, 0, 0.3) for turn in (-0.3, 0, 0.3)]
    for model in (LikelihoodField(field, Z_HIT, Z_RAND, SIGMA), LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA)):
        assert model.log_likelihood(np.array(POSE) + steps, beams, False).argmax() == steps.index((0, 0, 0))


def test_surfaces_exclude_the_inner_cells_of_solids() -> None:
    solid = np.zeros((8, 9), dtype=np.bool_)
    solid[2:7, 3:8] = True
    solid[0, :] = True
    surface_cells = surfaces(solid)
    assert not surface_cells[3:6, 4:7].any()
    assert surface_cells.sum() == 16 + 9


def test_beams_without_a_hit_have_no_effect() -> None:
    poses = np.random.default_rng(1).normal(POSE, 1.0, (20, 3))
    beams = select_beams(scan(np.full(BEAMS, np.inf)), 60, -1, 100)
    field = obstacle_field(grid(), 2.0)
    for model in (LikelihoodField(field, Z_HIT, Z_RAND, SIGMA), LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA)):
        assert (model.log_likelihood(poses, beams, False) == 0).all()


def scan_with_person() -> tuple[Beams, np.ndarray]:
    """Return a scan in which a person hides a third of the walls, and particles near the true pose."""
    ranges = cast(np.array([POSE]), -np.pi + np.pi / 180 * np.arange(BEAMS))[0]
    ranges[60:180] = np.minimum(ranges[60:180], 0.4)
    return select_beams(scan(ranges), 60, -1, 100), np.random.default_rng(2).normal(POSE, (0.05, 0.05, 0.03), (300, 3))


def test_beam_skipping_ignores_beams_that_few_particles_explain() -> None:
    beams, poses = scan_with_person()
    field, skipping = obstacle_field(grid(), 2.0), BeamSkipping(0.5, 0.3, 0.9)
    with_skipping = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA, skipping).log_likelihood(poses, beams, True)
    min_probability = Z_HIT * math.exp(-(0.5**2) / (2 * SIGMA**2)) + Z_RAND / beams.range_max
    rows = [np.array(probabilities(grid(), Pose2(*pose), beams)) for pose in poses[:9]]
    is_explained = np.mean(np.array(rows) > min_probability, axis=0) > 0.3
    explained_beams = Beams(beams.ranges[is_explained], beams.unit_vectors[is_explained], beams.origin, beams.range_max)
    without_skipping = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA).log_likelihood(poses, explained_beams, True)
    assert 0 < len(explained_beams.ranges) < 60
    assert np.allclose(with_skipping, without_skipping)


def test_beam_skipping_needs_convergence_and_is_off_with_too_many_outliers() -> None:
    beams, poses = scan_with_person()
    field = obstacle_field(grid(), 2.0)
    without_skipping = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA).log_likelihood(poses, beams, True)
    tolerant = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA, BeamSkipping(0.5, 0.3, 0.9))
    strict = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA, BeamSkipping(0.5, 0.3, 0.1))
    assert np.array_equal(tolerant.log_likelihood(poses, beams, False), without_skipping)
    assert np.array_equal(strict.log_likelihood(poses, beams, True), without_skipping)
