"""How sure a success rate is."""

import math

Z_95 = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""


def wilson(successes: float, runs: int, z: float = Z_95) -> tuple[float, float]:
    """The score interval of a proportion: what the true rate may be after `successes` of `runs`.

    Right also at 0 and at all of the runs, where the usual interval has no width. (Wilson 1927, JASA 22(158).)
    Half a success is one of two runs that count for one together. Raises ValueError without runs.
    """
    if runs < 1 or not 0 <= successes <= runs:
        raise ValueError(f"{successes} successes of {runs} runs")
    rate, square = successes / runs, z * z
    middle = (rate + square / (2 * runs)) / (1 + square / runs)
    half = z / (1 + square / runs) * math.sqrt(rate * (1 - rate) / runs + square / (4 * runs * runs))
    return max(0.0, middle - half), min(1.0, middle + half)
