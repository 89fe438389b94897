"""Tests of chi-square quantiles and probabilities against scipy."""

import pytest
from scipy.stats import chi2

from simscen.core.statistics import chi2_cdf, chi2_quantile, nees_mean_bounds


@pytest.mark.parametrize("freedom", [1, 2, 3, 60, 3000])
@pytest.mark.parametrize("probability", [0.001, 0.025, 0.5, 0.975, 0.999])
def test_quantiles_are_those_of_scipy(probability, freedom):
    assert chi2_quantile(probability, freedom) == pytest.approx(chi2.ppf(probability, freedom), rel=1e-9)


@pytest.mark.parametrize(("value", "freedom"), [(1e-3, 3), (3.0, 3), (40.0, 3), (3000.0, 3000)])
def test_probabilities_are_those_of_scipy(value, freedom):
    assert chi2_cdf(value, freedom) == pytest.approx(chi2.cdf(value, freedom), abs=1e-12)


@pytest.mark.parametrize(("probability", "freedom"), [(0.0, 3), (1.0, 3), (-0.1, 3), (0.5, 0)])
def test_invalid_probability_is_refused(probability, freedom):
    with pytest.raises(ValueError, match="degrees of freedom"):
        chi2_quantile(probability, freedom)


def test_bounds_of_one_run_equal_those_of_a_chi_square_variable():
    assert nees_mean_bounds(1, 3, 0.95) == pytest.approx((0.2158, 9.3484), abs=1e-4)
