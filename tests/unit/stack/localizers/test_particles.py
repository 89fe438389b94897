"""Tests of initial particles and of properties of a set of particles."""

import numpy as np
import pytest
from scipy import stats

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Estimate
from simscen.stack.localizers.particles import FreeSpace, Particles

GRID = OccupancyGrid(
    np.array([[FREE, OCCUPIED, FREE], [UNKNOWN, FREE, FREE]], dtype=np.int8), 0.5, Pose2(3.0, -1.0, 0.9)
)


def test_random_poses_are_uniform_over_free_cells_and_headings() -> None:
    poses = FreeSpace(GRID).draw(20_000, np.random.default_rng(1))
    cells = GRID.cell_of(poses[:, :2])
    counts = np.bincount(cells[:, 0] * 3 + cells[:, 1], minlength=6)
    assert counts[[1, 3]].tolist() == [0, 0]
    assert stats.chisquare(counts[[0, 2, 4, 5]]).pvalue > 1e-3
    assert stats.kstest(poses[:, 2], stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > 1e-3
    cell_fractions = GRID.origin.inverse().apply(poses[:, :2]) / 0.5 % 1
    assert stats.kstest(cell_fractions[:, 0], "uniform").pvalue > 1e-3


def test_poses_of_a_map_without_free_cells_are_on_the_map() -> None:
    full = OccupancyGrid(np.full((3, 3), OCCUPIED, dtype=np.int8), 1.0)
    poses = FreeSpace(full).draw(50, np.random.default_rng(1))
    assert (poses[:, :2] >= 0).all()
    assert (poses[:, :2] <= 3).all()


def test_initial_particles_have_the_mean_and_standard_deviations_of_the_estimate() -> None:
    std = (0.5, 0.1, 0.2)
    particles = FreeSpace(GRID).initial_particles(Estimate(Pose2(1, 2, 3), std), 50_000, np.random.default_rng(2))
    error = particles.poses - (1, 2, 3)
    error[:, 2] = (error[:, 2] + np.pi) % (2 * np.pi) - np.pi
    assert np.allclose(error.mean(axis=0), 0, atol=0.01)
    assert np.allclose(error.std(axis=0), std, rtol=0.02)
    assert np.abs(particles.poses[:, 2]).max() <= np.pi


def test_effective_number_is_between_one_and_all_particles() -> None:
    assert Particles.with_equal_weights(np.zeros((40, 3))).effective_count == pytest.approx(40)
    assert Particles(np.zeros((40, 3)), np.eye(40)[3]).effective_count == pytest.approx(1)


def test_extent_of_headings_is_the_smallest_angle_that_contains_them() -> None:
    poses = np.array([[0.0, 0.0, np.pi - 0.05], [0.1, 0.0, 0.02 - np.pi], [0.0, 0.3, np.pi - 0.01]])
    assert Particles.with_equal_weights(poses).extent == pytest.approx((0.1, 0.3, 0.07))
    around = np.array([[0.0, 0.0, heading] for heading in (-3.0, 0.0, 3.0)])
    assert Particles.with_equal_weights(around).extent[2] == pytest.approx(2 * np.pi - 3.0)
