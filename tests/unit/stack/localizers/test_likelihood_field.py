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
    """Table 6.3, one beam after the other, with distances searched by hand."""
    centers = room.center_of(np.argwhere(surfaces(room.cells == OCCUPIED)))
    result = []
    for end in pose.apply(beams.ends.view(np.float64).reshape(-1, 2)):
        cell = room.cell_of(end[None])
        distance = 2.0
        if room.inside(cell)[0]:
            distance = min(2.0, float(np.hypot(*(centers - room.center_of(cell)).T).min()))
        result.append(Z_HIT * math.exp(-(distance**2) / (2 * SIGMA**2)) + Z_RAND / beams.range_max)
    return result


@pytest.mark.parametrize("turned", [0.0, 0.7])
def test_both_models_agree_with_the_formulas_worked_out_by_hand(turned: float) -> None:
    room = OccupancyGrid(grid().cells, 0.05, Pose2(*grid().origin[:2], turned))
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


def test_beam_end_inside_a_solid_is_unlikely() -> None:
    solid = np.zeros((8, 9), dtype=np.bool_)
    solid[2:7, 3:8] = True
    solid[0, :] = True
    found = surfaces(solid)
    assert not found[3:6, 4:7].any()
    assert found.sum() == 16 + 9


def test_beams_without_a_hit_have_no_effect() -> None:
    poses = np.random.default_rng(1).normal(POSE, 1.0, (20, 3))
    blind = select_beams(scan(np.full(BEAMS, np.inf)), 60, -1, 100)
    field = obstacle_field(grid(), 2.0)
    for model in (LikelihoodField(field, Z_HIT, Z_RAND, SIGMA), LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA)):
        assert (model.log_likelihood(poses, blind, False) == 0).all()


def crowded() -> tuple[Beams, np.ndarray]:
    """A scan in which a person hides a third of the walls, and particles close around the truth."""
    ranges = cast(np.array([POSE]), -np.pi + np.pi / 180 * np.arange(BEAMS))[0]
    ranges[60:180] = np.minimum(ranges[60:180], 0.4)
    return select_beams(scan(ranges), 60, -1, 100), np.random.default_rng(2).normal(POSE, (0.05, 0.05, 0.03), (300, 3))


def test_beam_skipping_ignores_beams_that_few_particles_explain() -> None:
    beams, poses = crowded()
    field, skipping = obstacle_field(grid(), 2.0), BeamSkipping(0.5, 0.3, 0.9)
    skipped = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA, skipping).log_likelihood(poses, beams, True)
    near = Z_HIT * math.exp(-(0.5**2) / (2 * SIGMA**2)) + Z_RAND / beams.range_max
    explained = (
        np.mean([np.array(probabilities(grid(), Pose2(*pose), beams)) > near for pose in poses[:9]], axis=0) > 0.3
    )
    kept = Beams(beams.ranges[explained], beams.unit_vectors[explained], beams.origin, beams.range_max)
    plain = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA).log_likelihood(poses, kept, True)
    assert 0 < len(kept.ranges) < 60
    assert np.allclose(skipped, plain)


def test_beam_skipping_needs_convergence_and_is_off_with_too_many_outliers() -> None:
    beams, poses = crowded()
    field = obstacle_field(grid(), 2.0)
    plain = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA).log_likelihood(poses, beams, True)
    careful = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA, BeamSkipping(0.5, 0.3, 0.9))
    strict = LikelihoodFieldProb(field, Z_HIT, Z_RAND, SIGMA, BeamSkipping(0.5, 0.3, 0.1))
    assert np.array_equal(careful.log_likelihood(poses, beams, False), plain)
    assert np.array_equal(strict.log_likelihood(poses, beams, True), plain)
