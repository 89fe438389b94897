"""Tests of systematic resampling and KLD sampling."""

import numpy as np
import pytest
from filterpy.monte_carlo import resampling as filterpy_resampling
from scipy import stats

from simscen.core.geometry import Array
from simscen.stack.localizers.resampling import KldBound, bin_keys, kld_sampling, systematic_resampling


def weights(seed: int, count: int = 300) -> Array:
    """Return random weights, most of which are small, with a sum of 1."""
    values = np.random.default_rng(seed).random(count) ** 6
    result: Array = values / values.sum()
    return result


@pytest.mark.parametrize("seed", range(8))
def test_systematic_resampling_equals_filterpy(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    offset = np.random.default_rng(seed).random()
    monkeypatch.setattr(filterpy_resampling, "random", lambda: offset)
    expected = filterpy_resampling.systematic_resample(weights(seed))
    assert np.array_equal(systematic_resampling(weights(seed), 300, np.random.default_rng(seed)), expected)


@pytest.mark.parametrize("count", [1, 7, 300, 1000])
def test_each_index_is_drawn_in_proportion_to_its_weight_within_one_draw(count: int) -> None:
    drawn = np.bincount(systematic_resampling(weights(1), count, np.random.default_rng(1)), minlength=300)
    assert drawn.sum() == count
    assert (np.abs(drawn - count * weights(1)) < 1 + 1e-9).all()


def test_a_particle_without_weight_is_never_drawn() -> None:
    particle_weights = np.array([0.0, 0.5, 0.0, 0.5, 0.0])
    rng = np.random.default_rng(0)
    drawn = np.concatenate([systematic_resampling(particle_weights, 9, rng) for _ in range(200)])
    assert set(drawn.tolist()) == {1, 3}


def test_draws_follow_the_weights() -> None:
    """The single draws are independent, so a chi-square test applies."""
    particle_weights, rng = weights(5, 20), np.random.default_rng(5)
    drawn = np.bincount([int(systematic_resampling(particle_weights, 1, rng)[0]) for _ in range(20_000)], minlength=20)
    is_likely = particle_weights > 1e-3
    expected = particle_weights[is_likely] / particle_weights[is_likely].sum() * drawn[is_likely].sum()
    assert stats.chisquare(drawn[is_likely], expected).pvalue > 1e-3


def test_truncated_adaptive_draws_follow_the_weights() -> None:
    poses, rng = np.random.default_rng(1).uniform(-2, 2, (50, 3)), np.random.default_rng(2)
    particle_weights, bound = weights(6, 50), KldBound(0.05, 0.99, 100, 5000)

    def draw(count: int) -> Array:
        return rng.permutation(poses[systematic_resampling(particle_weights, count, rng)])

    drawn = [kld_sampling(draw, bound) for _ in range(400)]
    assert any(len(sample) % 100 for sample in drawn), "no sample was truncated"
    share = np.mean([np.mean(np.isclose(sample[:, :1], poses[:, 0]), axis=0) for sample in drawn], axis=0)
    assert np.allclose(share, particle_weights, atol=0.001, rtol=0.02)


def test_wide_distribution_needs_more_particles_than_a_narrow_one() -> None:
    rng, bound = np.random.default_rng(3), KldBound(0.05, 0.99, 100, 2000)
    sizes = [len(kld_sampling(lambda n, s=spread: rng.normal(0.2, s, (n, 3)), bound)) for spread in (0.01, 0.3, 0.8, 9)]
    assert sizes == sorted(sizes)
    assert (sizes[0], sizes[-1]) == (100, 2000)


def test_number_of_particles_equals_the_kld_bound_of_the_occupied_bins() -> None:
    rng, bound = np.random.default_rng(3), KldBound(0.05, 0.99, 100, 5000)
    samples = kld_sampling(lambda n: rng.normal(0, 0.5, (n, 3)), bound)
    assert len(samples) == pytest.approx(int(bound.samples(len(np.unique(bin_keys(samples))))), abs=1)
