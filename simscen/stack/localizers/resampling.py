"""Resampling of particles: KLD sampling adapts their number; Augmented MCL adds random particles to find a lost robot.

KLD sampling: Fox, Adapting the Sample Size in Particle Filters Through KLD-Sampling, IJRR 22 (2003), equation 7;
Probabilistic Robotics, table 8.4. The histogram has the bins of nav2_amcl (pf_kdtree.c): 0.5 m x 0.5 m x 10°.

Augmented MCL: Thrun, Burgard & Fox, Probabilistic Robotics, section 8.3.5 and table 8.3.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

Indices = npt.NDArray[np.int64]


def systematic_resampling(weights: Array, count: int, rng: np.random.Generator) -> Indices:
    """Return ascending indices (count,), drawn in proportion to `weights` (n,).

    Source: the low-variance sampler of Probabilistic Robotics, table 4.4.
    """
    cumulative = weights.cumsum()
    positions = (np.arange(count) + rng.random()) * (cumulative[-1] / count)
    drawn = cumulative.searchsorted(positions, side="right")
    # The last position can be rounded up to the total; it then belongs to the last index with any weight.
    clipped: Indices = np.minimum(drawn, cumulative.searchsorted(cumulative[-1]))
    return clipped


BIN_SIZE_M = 0.5
"""Edge length of a histogram bin."""
YAW_BINS = 36
"""Number of histogram bins of the heading, 10° each."""
_OFFSET = 1 << 21
"""Number that is added to the coordinates x and y of a bin, so that both are positive in the key."""
Keys = npt.NDArray[np.int64]
"""Keys of histogram bins: numbers that encode the integer coordinates x, y, yaw."""


def bin_keys(poses: Array) -> Keys:
    """Return the keys (n,) of the histogram bins of `poses` (n, 3). Headings need not be wrapped."""
    cells = np.clip(np.floor(poses[:, :2] / BIN_SIZE_M), -_OFFSET + 2, _OFFSET - 2).astype(np.int64)
    yaw = np.floor(poses[:, 2] * (YAW_BINS / (2 * np.pi))).astype(np.int64) % YAW_BINS
    return encode_bins(cells[:, 0], cells[:, 1], yaw)


def encode_bins(x: Keys, y: Keys, yaw: Keys) -> Keys:
    """Return the keys of bins with these integer coordinates."""
    return ((x + _OFFSET) * (2 * _OFFSET) + (y + _OFFSET)) * YAW_BINS + yaw


def decode_bins(keys: Keys) -> tuple[Keys, Keys, Keys]:
    """Return the integer coordinates x, y, yaw of bins."""
    cells, yaw = np.divmod(keys, YAW_BINS)
    x, y = np.divmod(cells, 2 * _OFFSET)
    return x - _OFFSET, y - _OFFSET, yaw


@dataclass(frozen=True)
class KldBound:
    """KLD bound: number of samples for which the sampled distribution differs from the true one by at most `error`.

    `z` is the quantile of the standard normal distribution for the required probability. As in nav2_amcl, the
    parameter `pf_z` (default 0.99) is used as the quantile itself, not as the probability.
    """

    error: float
    z: float
    min_samples: int
    max_samples: int

    def samples(self, occupied: npt.ArrayLike) -> Keys:
        """Return the number of samples needed for each number of occupied bins.

        The result is between `min_samples` and `max_samples`; `min_samples` for a single bin.
        """
        degrees = np.maximum(np.asarray(occupied, dtype=np.float64) - 1, 1e-9)
        spread = 2 / (9 * degrees)
        needed = np.where(degrees >= 1, degrees / (2 * self.error) * (1 - spread + np.sqrt(spread) * self.z) ** 3, 0)
        return np.clip(np.ceil(needed), self.min_samples, self.max_samples).astype(np.int64)

    def sufficient_count(self, keys: Keys) -> int | None:
        """Return the smallest sufficient number of samples, given the bin keys (n,); None if n are not sufficient."""
        if len(keys) == self.min_samples:  # no smaller number can be sufficient
            return self.min_samples if self.min_samples >= self.samples(len(np.unique(keys))) else None
        is_new = np.zeros(len(keys), dtype=np.int64)
        is_new[np.unique(keys, return_index=True)[1]] = 1
        counts = np.arange(1, len(keys) + 1)
        satisfied = counts >= self.samples(np.cumsum(is_new))
        return int(counts[satisfied.argmax()]) if satisfied.any() else None


def kld_sampling(draw: Callable[[int], Array], bound: KldBound) -> Array:
    """Draw poses (n, 3 or more) with `draw(count)` until their number satisfies the KLD bound.

    Source: Fox (2003), table 3, but in blocks instead of one by one. `draw` must return poses in random order.
    """
    poses = draw(bound.min_samples)
    while (count := bound.sufficient_count(bin_keys(poses))) is None:
        poses = np.concatenate((poses, draw(min(len(poses), bound.max_samples - len(poses)))))
    return poses[:count]


PROBE_COUNT = 200
"""Number of random poses at which each scan is evaluated."""
MIN_BETTER_FRACTION = 0.1
"""The robot is lost only if at least this fraction of random poses fits recent scans better than the particles."""
MAX_STRAY_SCANS = 4.0
"""Limit of random particles and their descendants ("strays"): the number that can be added at this many scans."""
_MAX_LOG_RATIO = 50.0
"""Maximum logarithm of a likelihood ratio, so that its exponential stays finite."""


class AugmentedMcl:
    """Decides how many random particles to add, from a fast and a slow running average of a likelihood ratio.

    The ratio is the likelihood of a scan at the particles, divided by its likelihood at PROBE_COUNT random poses.
    (nav2_amcl averages the likelihood itself, which also decreases if obstacles are not on the map.)

    Random particles are added while two conditions hold: the fast average is below the slow one, and at least
    MIN_BETTER_FRACTION of the random poses fit recent scans better than the particles.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float, max_fraction: float = 1.0) -> None:
        """Take Nav2's recovery_alpha_slow and recovery_alpha_fast, and the largest fraction to add at one scan."""
        self.is_enabled, self._max_fraction = alpha_fast > 0, max_fraction
        self._slow, self._fast = RunningAverage(alpha_slow), RunningAverage(alpha_fast)
        self._better_fraction = RunningAverage(alpha_fast)

    def observe(self, tracked: float, anywhere: Array) -> None:
        """Add log likelihoods of a scan: `tracked`, the mean over the particles, and `anywhere` (n,), at random poses.

        Likelihoods of different scans must be comparable (see SensorModel.tempering_exponent).
        """
        best = float(anywhere.max())
        average = best + math.log(float(np.mean(np.exp(anywhere - best)))) if best > -np.inf else -np.inf
        ratio = math.exp(min(tracked - average, _MAX_LOG_RATIO)) if tracked > -np.inf else 0.0
        self._slow.add(ratio)
        self._fast.add(ratio)
        self._better_fraction.add(float(np.mean(anywhere > tracked)))

    @property
    def random_fraction(self) -> float:
        """Fraction of new particles to draw at random: 1 - fast / slow, at most `max_fraction`; 0 if not lost."""
        slow, fast = self._slow.value, self._fast.value
        if slow <= 0 or self._better_fraction.value < MIN_BETTER_FRACTION:
            return 0.0
        return min(self._max_fraction, max(0.0, 1 - fast / slow))

    def kept_fraction(self, stray_weight: float) -> float:
        """Return the fraction of earlier random particles and their descendants to keep, given their weight (0 … 1)."""
        allowed = min(1.0, MAX_STRAY_SCANS * self._max_fraction) - self.random_fraction
        return 1.0 if stray_weight <= allowed else max(0.0, allowed / stray_weight)


class RunningAverage:
    """Average with exponentially decaying weights, or with equal weights if `alpha` is zero. Without initial bias."""

    def __init__(self, alpha: float) -> None:
        self._alpha, self._sum, self._weight = alpha, 0.0, 0.0

    def add(self, value: float) -> None:
        """Add a value, after multiplying earlier weights by 1 - `alpha`."""
        decay = 1 - self._alpha
        self._sum, self._weight = decay * self._sum + value, decay * self._weight + 1

    @property
    def value(self) -> float:
        """The average; 0 before the first value."""
        return self._sum / self._weight if self._weight else 0.0
