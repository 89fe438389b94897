"""Tests of particle clusters, and of the pose and covariance computed from them."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.particles import Particles, cluster_labels, covariance_about, summarize
from simscen.stack.localizers.resampling import bin_keys, decode_bins


@pytest.mark.parametrize(("seed", "count", "width"), [(0, 40, 2.0), (1, 200, 4.0), (2, 600, 5.0), (3, 1, 1.0)])
def test_clusters_are_the_connected_components_of_adjacent_bins(seed: int, count: int, width: float) -> None:
    rng = np.random.default_rng(seed)
    keys = bin_keys(np.column_stack((rng.uniform(-width, width, (count, 2)), rng.uniform(-9, 9, count))))
    cells = np.column_stack(decode_bins(keys))
    bin_distances = np.abs(cells[:, None] - cells)
    bin_distances[..., 2] = np.minimum(bin_distances[..., 2], 36 - bin_distances[..., 2])
    expected = connected_components(coo_array((bin_distances <= 1).all(axis=2)))[1]
    labels = cluster_labels(keys)
    assert np.array_equal(labels[:, None] == labels, expected[:, None] == expected)


def normal_poses(pose: Pose2, std: float, count: int, seed: int) -> Array:
    poses: Array = np.random.default_rng(seed).normal(pose, std, (count, 3))
    return poses


@pytest.mark.parametrize("yaw", [0.3, np.pi])
def test_summary_of_a_narrow_cluster_is_accurate(yaw: float) -> None:
    """For narrow clusters, a single matrix product computes the sums; the heading is accurate within 1 µrad."""
    poses = normal_poses(Pose2(-20, 30, yaw), 0.02, 500, 5)
    poses[:, 2] = (poses[:, 2] + np.pi) % (2 * np.pi) - np.pi
    weights = np.random.default_rng(6).uniform(0, 1, 500)
    weights /= weights.sum()
    pose, covariance = summarize(Particles(poses, weights))
    circular_mean = float(np.angle(weights @ np.exp(1j * poses[:, 2])))
    assert pose[:2] == pytest.approx((weights @ poses[:, :2]).tolist(), abs=1e-9)
    assert abs(np.exp(1j * pose.yaw) - np.exp(1j * circular_mean)) < 1e-6
    errors = np.column_stack((poses[:, :2] - pose[:2], np.angle(np.exp(1j * (poses[:, 2] - pose.yaw)))))
    assert covariance == pytest.approx((errors.T * weights) @ errors, rel=1e-9, abs=1e-12)
    assert np.array_equal(covariance, covariance.T)


def test_pose_is_of_the_heaviest_cluster_and_covariance_of_all_particles() -> None:
    poses = np.concatenate((normal_poses(Pose2(0, 0, 1), 0.02, 300, 1), normal_poses(Pose2(4, 0, 1), 0.02, 700, 2)))
    weights = np.concatenate((np.full(300, 0.6 / 300), np.full(700, 0.4 / 700)))
    pose, covariance = summarize(Particles(poses, weights))
    assert pose == pytest.approx((0, 0, 1), abs=0.01)
    assert covariance[0, 0] == pytest.approx(0.4 * 16, rel=0.01)


def test_mean_heading_near_pi_is_not_zero() -> None:
    poses = normal_poses(Pose2(1, 2, np.pi), 0.03, 400, 3)
    poses[:, 2] = (poses[:, 2] + np.pi) % (2 * np.pi) - np.pi
    pose, covariance = summarize(Particles.with_equal_weights(poses))
    assert abs(abs(pose.yaw) - np.pi) < 0.01
    assert covariance[2, 2] == pytest.approx(0.03**2, rel=0.15)


def test_covariance_is_weighted_and_relative_to_the_pose() -> None:
    rng = np.random.default_rng(4)
    poses, weights = normal_poses(Pose2(0.2, 0.2, 0.05), 0.03, 500, 5), rng.random(500)
    particles = Particles(poses, weights / weights.sum())
    mean = Pose2(*np.average(poses, axis=0, weights=weights).tolist())
    assert np.allclose(covariance_about(particles, mean), np.cov(poses.T, aweights=weights, ddof=0))
    shift = np.array([0.3, -0.2, 0.1])
    covariance = covariance_about(particles, Pose2(*(np.array(mean) + shift)))
    assert np.allclose(covariance, np.cov(poses.T, aweights=weights, ddof=0) + np.outer(shift, shift))


def expected_x(far: float, weight_ratio: float, peak_power: float, variances: tuple[float, float]) -> float:
    """Return the expected x in m of a cluster of two groups of particles with these variances in m².

    One group is at x = 0, `weight_ratio` times as heavy as the other group at x = `far`.
    """
    means, spreads = [], []
    for power in (1.0, peak_power):
        share = 1 / (1 + weight_ratio**power)
        means.append(far * share)
        spreads.append((1 - share) * variances[0] + share * variances[1] + far**2 * share * (1 - share))
    return (means[0] * spreads[1] + means[1] * spreads[0]) / sum(spreads)


@pytest.mark.parametrize("peak_power", [1.0, 2.0, 16.0])
def test_light_group_shifts_the_pose_by_its_weights_to_the_peak_power(peak_power: float) -> None:
    poses = np.concatenate((normal_poses(Pose2(0, 0, 0), 0.03, 300, 6), normal_poses(Pose2(0.6, 0, 0), 0.1, 300, 7)))
    weights = np.repeat([1.3, 1.0], 300)
    pose, _ = summarize(Particles(poses, weights / weights.sum()), peak_power)
    assert pose.x == pytest.approx(expected_x(0.6, 1.3, peak_power, (0.0018, 0.02)), abs=0.01)


def uniform_poses(count: int = 2000, width: float = 3.0) -> Array:
    """Return uniformly distributed poses that form one cluster."""
    poses: Array = np.random.default_rng(8).uniform((-width, -width, -0.6), (width, width, 0.6), (count, 3))
    return poses


def test_pose_of_a_wide_uniform_cloud_is_its_center() -> None:
    poses = uniform_poses()
    for best in (3, 1500):
        weights = np.ones(len(poses))
        weights[best] += 1e-6
        pose, covariance = summarize(Particles(poses, weights / weights.sum()), 16.0)
        assert pose == pytest.approx(tuple(poses.mean(axis=0)), abs=1e-3)
        assert np.sqrt(covariance[0, 0]) == pytest.approx(3 / np.sqrt(3), rel=0.05)


@pytest.mark.parametrize("peak_power", [1.0, 16.0])
def test_small_weight_changes_move_the_pose_proportionally(peak_power: float) -> None:
    """So the pose does not jump unless a scan changes the weights much."""
    poses, rng = uniform_poses(), np.random.default_rng(9)
    weights = rng.uniform(1, 3, len(poses))
    before, _ = summarize(Particles(poses, weights / weights.sum()), peak_power)
    changed = weights * rng.choice([1, 1.001], len(poses))
    after, _ = summarize(Particles(poses, changed / changed.sum()), peak_power)
    assert before.distance(after) < 0.001 * peak_power * 3


def test_pose_moves_continuously_between_two_groups_of_a_cluster() -> None:
    poses = np.concatenate((normal_poses(Pose2(0, 0, 0), 0.05, 500, 10), normal_poses(Pose2(0.7, 0, 0), 0.05, 500, 11)))
    xs, weight_ratios = [], np.geomspace(0.6, 1.7, 81)
    for ratio in weight_ratios:
        weights = np.repeat([ratio, 1.0], 500)
        xs.append(summarize(Particles(poses, weights / weights.sum()), 16.0)[0].x)
    assert xs == pytest.approx([expected_x(0.7, ratio, 16.0, (0.005, 0.005)) for ratio in weight_ratios], abs=0.01)
    assert xs[0] > 0.6
    assert xs[-1] < 0.1
    assert np.abs(np.diff(xs)).max() < 0.05


@pytest.mark.parametrize("peak_power", [1.0, 16.0])
def test_pose_of_a_narrow_cloud_is_at_its_highest_weights(peak_power: float) -> None:
    """The weights follow a normal distribution, whose mean does not depend on the power."""
    poses = np.random.default_rng(12).uniform((-0.2, -0.2, -0.1), (0.2, 0.2, 0.1), (4000, 3))
    weights = np.exp(-0.5 * (np.square(poses - (0.05, -0.03, 0.02)) / 0.03**2).sum(axis=1))
    pose, _ = summarize(Particles(poses, weights / weights.sum()), peak_power)
    assert pose == pytest.approx((0.05, -0.03, 0.02), abs=0.005)


def test_pose_of_a_single_particle_is_its_pose() -> None:
    pose, covariance = summarize(Particles.with_equal_weights(np.array([[1.0, 2.0, 3.0]])))
    assert pose == pytest.approx((1, 2, 3))
    assert not covariance.any()


@pytest.mark.parametrize("seed", range(20))
def test_pose_is_the_mean_of_the_heaviest_connected_component(seed: int) -> None:
    """The clouds with even seeds are in at most two adjacent bins along each axis, and the others in more bins."""
    rng = np.random.default_rng(seed)
    std = (0.12, 0.12, 0.05) if seed % 2 else (0.02, 0.02, 0.05)
    poses = rng.uniform((-1, -1, -0.3), (1, 1, 0.3), 3) + rng.normal(0, std, (300, 3))
    poses[: seed % 3 * 40] += (1.0, 0.0, 0.0)  # a lighter cluster if the standard deviation is small
    weights = rng.uniform(0.5, 1, 300)
    weights /= weights.sum()
    cells = np.column_stack(decode_bins(bin_keys(poses)))
    bin_distances = np.abs(cells[:, None] - cells)
    bin_distances[..., 2] = np.minimum(bin_distances[..., 2], 36 - bin_distances[..., 2])
    labels = connected_components(coo_array((bin_distances <= 1).all(axis=2)))[1]
    is_heaviest = labels == np.bincount(labels, weights=weights).argmax()
    x, y, yaw = np.average(poses[is_heaviest], axis=0, weights=weights[is_heaviest])
    pose, _ = summarize(Particles(poses, weights))
    assert pose == pytest.approx((x, y, yaw), abs=1e-4)
