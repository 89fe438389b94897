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
    """Fox (2003), equation 5: n = χ²(k-1, 1-δ) / 2ε. The bound is the approximation of Wilson and Hilferty."""
    bound = KldBound(0.05, z, 1, 10**6)
    exact = stats.chi2.ppf(stats.norm.cdf(z), occupied - 1) / (2 * 0.05)
    assert bound.samples(occupied) == pytest.approx(exact, rel=0.01, abs=1)


def test_bound_is_between_its_limits_also_for_no_or_one_bin() -> None:
    bound = KldBound(0.05, 0.99, 500, 2000)
    assert bound.samples([0, 1, 2, 10, 10_000]).tolist() == [500, 500, 500, 500, 2000]


@given(coordinates, coordinates, st.integers(0, 35))
def test_decoded_bin_keys_equal_the_encoded_coordinates(x: int, y: int, yaw: int) -> None:
    parts = decode_bins(encode_bins(*(np.array([part]) for part in (x, y, yaw))))
    assert [int(part[0]) for part in parts] == [x, y, yaw]


@settings(max_examples=50)
@given(st.lists(st.tuples(*[st.floats(-20, 20)] * 3), min_size=1, max_size=40))
def test_particles_share_a_key_exactly_if_they_are_in_the_same_bin(poses: list[tuple[float, ...]]) -> None:
    bins = [(x // BIN_SIZE_M, y // BIN_SIZE_M, int(np.floor(yaw * 18 / np.pi)) % 36) for x, y, yaw in poses]
    keys = bin_keys(np.array(poses)).tolist()
    assert [keys.index(key) for key in keys] == [bins.index(bin_) for bin_ in bins]


def test_headings_that_differ_by_360_degrees_share_a_bin() -> None:
    near, far = bin_keys(np.array([[0.1, 0.1, 0.05], [0.1, 0.1, 0.05 + 2 * np.pi]]))
    assert near == far


@settings(max_examples=60)
@given(st.lists(st.integers(0, 60), min_size=1, max_size=600), st.integers(1, 200))
def test_sufficient_number_equals_sequential_counting(keys: list[int], minimum: int) -> None:
    bound, keys_so_far, expected = KldBound(0.05, 0.99, minimum, 500), set(), None
    for count, key in enumerate(keys, 1):
        keys_so_far.add(key)
        if count >= bound.samples(len(keys_so_far)):
            expected = count
            break
    assert bound.sufficient_count(np.array(keys)) == expected


@pytest.mark.parametrize(("pf_err", "pf_z"), [(0.01, 0.99), (0.05, 0.5)])
def test_pf_err_and_pf_z_change_the_number_of_samples(pf_err: float, pf_z: float) -> None:
    default, other = KldBound(0.05, 0.99, 10, 50_000), KldBound(pf_err, pf_z, 10, 50_000)
    assert other.samples(40) != default.samples(40)
