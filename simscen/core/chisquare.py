"""Quantiles of the chi-square distribution; scipy, which has them, takes half a second to import."""

import math


def quantile(probability: float, freedom: int) -> float:
    """The value that a chi-square variable of `freedom` degrees stays below with this probability.

    Raises ValueError unless 0 < probability < 1 and freedom >= 1.
    """
    if not 0.0 < probability < 1.0 or freedom < 1:
        raise ValueError(f"probability {probability:g} with {freedom} degrees of freedom")
    low, high = 0.0, float(freedom)
    while below(high, freedom) < probability:
        high *= 2.0
    while (middle := (low + high) / 2.0) not in (low, high):
        low, high = (middle, high) if below(middle, freedom) < probability else (low, middle)
    return high


def below(value: float, freedom: int) -> float:
    """The probability of staying below a value > 0: the regularised incomplete gamma function P(freedom/2, value/2).

    Its power series, whose terms are all positive (Abramowitz and Stegun 1964, 6.5.29).
    """
    a, x = freedom / 2.0, value / 2.0
    term = total = 1.0 / a
    n = a
    while term > total * 1e-17:
        n += 1.0
        term *= x / n
        total += term
    return min(1.0, total * math.exp(a * math.log(x) - x - math.lgamma(a)))


def mean_bounds(samples: int, dimensions: int, probability: float) -> tuple[float, float]:
    """Between which the mean of so many squared errors lies with this probability, each a sum of `dimensions` squares.

    chi2(dimensions x samples) / samples, two-sided: what a consistent estimator's NEES keeps (Bar-Shalom et al. 2001).
    """
    tail, freedom = (1.0 - probability) / 2.0, dimensions * samples
    return quantile(tail, freedom) / samples, quantile(1.0 - tail, freedom) / samples
