"""Particles are grouped as a graph library groups them, and summed up as a statistics library sums them up."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.clusters import clusters, spread, summarise
from simscen.stack.localizers.kld import bins, split
from simscen.stack.localizers.particles import Particles


@pytest.mark.parametrize(("seed", "count", "width"), [(0, 40, 2.0), (1, 200, 4.0), (2, 600, 5.0), (3, 1, 1.0)])
def test_groups_are_the_connected_components_of_touching_bins(seed: int, count: int, width: float) -> None:
    chance = np.random.default_rng(seed)
    keys = bins(np.column_stack((chance.uniform(-width, width, (count, 2)), chance.uniform(-9, 9, count))))
    cells = np.column_stack(split(keys))
    apart = np.abs(cells[:, None] - cells)
    apart[..., 2] = np.minimum(apart[..., 2], 36 - apart[..., 2])
    expected = connected_components(coo_array((apart <= 1).all(axis=2)))[1]
    found = clusters(keys)
    assert np.array_equal(found[:, None] == found, expected[:, None] == expected)


def group(pose: Pose2, std: float, count: int, seed: int) -> Array:
    drawn: Array = np.random.default_rng(seed).normal(pose, std, (count, 3))
    return drawn


def test_the_pose_is_that_of_the_heavier_group_and_the_covariance_shows_the_other() -> None:
    poses = np.concatenate((group(Pose2(0, 0, 1), 0.02, 300, 1), group(Pose2(4, 0, 1), 0.02, 700, 2)))
    weights = np.concatenate((np.full(300, 0.6 / 300), np.full(700, 0.4 / 700)))
    pose, covariance = summarise(Particles(poses, weights))
    assert pose == pytest.approx((0, 0, 1), abs=0.01)
    assert covariance[0, 0] == pytest.approx(0.4 * 16, rel=0.01)


def test_a_pose_is_not_averaged_across_the_cut_of_the_circle_to_its_opposite() -> None:
    poses = group(Pose2(1, 2, np.pi), 0.03, 400, 3)
    poses[:, 2] = (poses[:, 2] + np.pi) % (2 * np.pi) - np.pi
    pose, covariance = summarise(Particles.equal(poses))
    assert abs(abs(pose.yaw) - np.pi) < 0.01
    assert covariance[2, 2] == pytest.approx(0.03**2, rel=0.15)


def test_the_covariance_is_the_weighted_one_about_the_pose() -> None:
    chance = np.random.default_rng(4)
    poses, weights = group(Pose2(0.2, 0.2, 0.05), 0.03, 500, 5), chance.random(500)
    particles = Particles(poses, weights / weights.sum())
    mean = Pose2(*np.average(poses, axis=0, weights=weights).tolist())
    assert np.allclose(spread(particles, mean), np.cov(poses.T, aweights=weights, ddof=0))
    shift = np.array([0.3, -0.2, 0.1])
    about = spread(particles, Pose2(*(np.array(mean) + shift)))
    assert np.allclose(about, np.cov(poses.T, aweights=weights, ddof=0) + np.outer(shift, shift))


def test_the_pose_is_the_mean_of_the_particles_near_the_best_one() -> None:
    """A tail on one side, which belongs to the same cluster, does not draw the pose away."""
    peak, tail = group(Pose2(0, 0, 0), 0.03, 300, 6), group(Pose2(0.6, 0, 0), 0.1, 300, 7)
    weights = np.concatenate((np.full(300, 2.0), np.full(300, 1.0)))
    weights[0] = 2.1
    pose, _ = summarise(Particles(np.concatenate((peak, tail)), weights / weights.sum()))
    assert pose == pytest.approx((0, 0, 0), abs=0.01)


def test_a_single_particle_is_the_answer() -> None:
    pose, covariance = summarise(Particles.equal(np.array([[1.0, 2.0, 3.0]])))
    assert pose == pytest.approx((1, 2, 3))
    assert not covariance.any()
