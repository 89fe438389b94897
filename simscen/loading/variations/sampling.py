"""Samples values for variations. Random numbers are hashes of the seed, the path, and the number of the variation."""

import hashlib
import math
from functools import cache
from typing import Any

from simscen.model.variations import Draw, Integer, LogUniform, Normal, OneOf, Sampled, Uniform
from simscen.spec.quantities import Amount, to_common_unit

_SIGNIFICANT_DIGITS = 6


def probability(sampled: Sampled, path: str, index: int) -> float:
    """Return the cumulative probability, in (0, 1), of the value of a path in variation number `index` (≥ 0).

    With the method `random`, the index may exceed `sampled.count`.
    """
    if sampled.method == "sobol":
        return _sobol_probability(sampled, path, index)
    u = _hashed_uniform(sampled.seed, path, "value", index)
    if sampled.method == "random":
        return u
    return (_strata(sampled.seed, path, sampled.count)[index] + u) / sampled.count


@cache
def _strata(seed: int, path: str, count: int) -> list[int]:
    """Return the number of the interval of each variation in a Latin hypercube: 0 to `count` - 1 in random order."""
    return sorted(range(count), key=lambda number: _hashed_uniform(seed, path, "stratum", number))


def _sobol_probability(sampled: Sampled, path: str, index: int) -> float:
    """Return the coordinate of a path in a point of a Sobol sequence with a random shift modulo 1.

    (Joe and Kuo: Constructing Sobol Sequences with Better Two-Dimensional Projections, 2008; Cranley and Patterson:
    Randomization of Number Theoretic Methods for Multiple Integration, 1976.)
    """
    point = _sobol_points(len(sampled.values), sampled.count)[index]
    shift = _hashed_uniform(sampled.seed, path, "shift", 0)
    u = (float(point[sorted(sampled.values).index(path)]) + shift) % 1.0
    return min(max(u, 2.0**-53), 1 - 2.0**-53)


@cache
def _sobol_points(dimensions: int, count: int) -> Any:
    """Return the first `count` points of the unscrambled Sobol sequence, shape (count, dimensions)."""
    from scipy.stats.qmc import Sobol  # the import takes half a second

    exponent = max(0, math.ceil(math.log2(count)))
    return Sobol(dimensions, scramble=False).random_base2(exponent)[:count]


def _hashed_uniform(seed: int, path: str, purpose: str, number: int) -> float:
    """Return a number that is uniformly distributed on (0, 1): a hash of the arguments."""
    digest = hashlib.sha256(f"{seed}\0{path}\0{purpose}\0{number}".encode()).digest()
    return ((int.from_bytes(digest[:8], "big") >> 12) + 0.5) / 2**52


def quantile(distribution: Draw, u: float) -> Any:
    """Return the quantile of a distribution at the cumulative probability `u`, 0 < u < 1.

    A quantity is text with its unit. For a `choice`, the quantile is the index of an item. Raises ValueError if the
    parameters of the distribution are invalid.
    """
    match distribution.chosen:
        case Uniform(root=ends):
            (low, high), unit = _ends_in_common_unit(ends)
            return _with_unit(low + u * (high - low), unit)
        case LogUniform(root=ends):
            (low, high), unit = _ends_in_common_unit(ends)
            if low <= 0:
                raise ValueError("the ends of `log_uniform` must be greater than 0")
            return _with_unit(low * (high / low) ** u, unit)
        case Integer(root=(first, last)):
            if first > last:
                raise ValueError(f"the range is empty: {first} is greater than {last}")
            return first + math.floor(u * (last - first + 1))
        case OneOf(root=values):
            return math.floor(u * len(values))
        case Normal() as normal:
            return _truncated_normal_quantile(normal, u)
    raise AssertionError(distribution.kind)


def _ends_in_common_unit(ends: tuple[Amount, Amount]) -> tuple[tuple[float, float], str]:
    """Return the ends of a range as numbers and their common unit. Raises ValueError if the range is empty."""
    (low, high), unit = to_common_unit(ends)
    if low > high:
        raise ValueError(f"the range is empty: {low:g} is greater than {high:g}")
    return (low, high), unit


def _truncated_normal_quantile(normal: Normal, u: float) -> Any:
    """Return the quantile of a normal distribution truncated to `min` and `max`. Raises ValueError if it is invalid."""
    from statistics import NormalDist  # slow to import, rarely needed

    ends = [end for end in (normal.min, normal.max) if end is not None]
    (mean, std, *bounds), unit = to_common_unit((normal.mean, normal.std, *ends))
    if std <= 0:
        raise ValueError("`std` must be greater than 0")
    distribution = NormalDist(mean, std)
    low = bounds[0] if normal.min is not None else -math.inf
    high = bounds[-1] if normal.max is not None else math.inf
    if low >= high:
        raise ValueError(f"`min` {low:g} is not less than `max` {high:g}")
    min_probability, max_probability = distribution.cdf(low) if ends else 0.0, distribution.cdf(high) if ends else 1.0
    if max_probability - min_probability < 1e-12:
        raise ValueError("the range from `min` to `max` is too many `std` away from `mean`")
    number = distribution.inv_cdf(min_probability + u * (max_probability - min_probability))
    return _with_unit(min(max(number, low), high), unit)


def _with_unit(number: float, unit: str) -> Any:
    """Return the rounded number; with a unit as text, such as "0.5 m"."""
    rounded = float(f"{number:.{_SIGNIFICANT_DIGITS}g}")
    return f"{rounded!r} {unit}" if unit else rounded
