"""Tests of KLD sampling against Fox's bound."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from simscen.stack.localizers.resampling import BIN_SIZE_M, KldBound, bin_keys, decode_bins, encode_bins

coordinates = st.integers(-2_000_000, 2_000_000)


@pytest.mark.parametrize("z", [0.99, 2.326])
@pytest.mark.parametrize("occupied", [3, 10, 50, 400, 3000])
def test_kld_bound_equals_the_chi_square_quantile(occupied: int, z: float) -> None:
    """Fox (2003), equation 5: n = χ²(k-1, 1-δ) / 2ε, of which the bound is Wilson and Hilferty's approximation."""
    bound = KldBound(0.05, z, 1, 10**6)
    exact = stats.chi2.ppf(stats.norm.cdf(z), occupied - 1) / (2 * 0.05)
    assert bound.samples(occupied) == pytest.approx(exact, rel=0.01, abs=1)


def test_the_bound_stays_between_its_limits_and_one_bin_needs_no_samples() -> None:
    bound = KldBound(0.05, 0.99, 500, 2000)
    assert bound.samples([0, 1, 2, 10, 10_000]).tolist() == [500, 500, 500, 500, 2000]


@given(coordinates, coordinates, st.integers(0, 35))
def test_bin_keys_are_unique_per_coordinates(x: int, y: int, yaw: int) -> None:
    parts = decode_bins(encode_bins(*(np.array([part]) for part in (x, y, yaw))))
    assert [int(part[0]) for part in parts] == [x, y, yaw]


@settings(max_examples=50)
@given(st.lists(st.tuples(*[st.floats(-20, 20)] * 3), min_size=1, max_size=40))
def test_particles_share_a_bin_exactly_when_their_whole_coordinates_are_equal(poses: list[tuple[float, ...]]) -> None:
    whole = [(x // BIN_SIZE_M, y // BIN_SIZE_M, int(np.floor(yaw * 18 / np.pi)) % 36) for x, y, yaw in poses]
    keys = bin_keys(np.array(poses)).tolist()
    assert [keys.index(key) for key in keys] == [whole.index(cell) for cell in whole]


def test_headings_a_full_turn_apart_share_a_bin() -> None:
    near, far = bin_keys(np.array([[0.1, 0.1, 0.05], [0.1, 0.1, 0.05 + 2 * np.pi]]))
    assert near == far


@settings(max_examples=60)
@given(st.lists(st.integers(0, 60), min_size=1, max_size=600), st.integers(1, 200))
def test_sufficient_number_equals_sequential_counting(keys: list[int], least: int) -> None:
    bound, seen, stop = KldBound(0.05, 0.99, least, 500), set(), None
    for count, key in enumerate(keys, 1):
        seen.add(key)
        if count >= bound.samples(len(seen)):
            stop = count
            break
    assert bound.sufficient_count(np.array(keys)) == stop


@pytest.mark.parametrize(("pf_err", "pf_z"), [(0.01, 0.99), (0.05, 0.5)])
def test_pf_err_and_pf_z_change_the_number_of_samples(pf_err: float, pf_z: float) -> None:
    default, other = KldBound(0.05, 0.99, 10, 50_000), KldBound(pf_err, pf_z, 10, 50_000)
    assert other.samples(40) != default.samples(40)
