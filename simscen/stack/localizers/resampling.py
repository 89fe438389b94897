"""Resampling of particles: KLD sampling adapts their number, and Augmented MCL adds random ones to find a lost robot.

KLD sampling: Fox, Adapting the Sample Size in Particle Filters Through KLD-Sampling, IJRR 22 (2003), equation 7;
Probabilistic Robotics, table 8.4. The histogram is nav2_amcl's (pf_kdtree.c): bins of 0.5 m x 0.5 m x 10°.

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
    """Return indices (count,), ascending, drawn in proportion to `weights` (n,) with minimum variance.

    Low-variance sampler of Probabilistic Robotics, table 4.4: an index with weight w is drawn ⌊count·w⌋ or ⌈count·w⌉
    times.
    """
    cumulative = weights.cumsum()
    positions = (np.arange(count) + rng.random()) * (cumulative[-1] / count)
    drawn = cumulative.searchsorted(positions, side="right")
    # The last position can be rounded up to the total; it then belongs to the last index with any weight.
    clipped: Indices = np.minimum(drawn, cumulative.searchsorted(cumulative[-1]))
    return clipped


BIN_SIZE_M = 0.5
"""Edge length of a histogram bin; fixed in nav2_amcl, too (pf_kdtree.c)."""
YAW_BINS = 36
"""Number of bins of the heading: 10° each, as in pf_kdtree.c."""
_OFFSET = 1 << 21
"""Added to the coordinates x and y of a bin, so that both are positive in its key."""
Keys = npt.NDArray[np.int64]
"""Keys of histogram bins, each of which encodes the integer coordinates x, y, yaw of a bin."""


def bin_keys(poses: Array) -> Keys:
    """Return the keys (n,) of the histogram bins of `poses` (n, 3). Headings may be outside of ±π."""
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
    """Number of samples for which the sampled distribution probably differs from the true one by at most `error`.

    `z` is the quantile of the standard normal distribution for this probability. Like nav2_amcl, simscen uses pf_z =
    0.99 as the quantile itself, not as the probability 0.99 (whose quantile is 2.33).
    """

    error: float
    z: float
    min_samples: int
    max_samples: int

    def samples(self, occupied: npt.ArrayLike) -> Keys:
        """Return the samples needed for numbers of occupied bins, between `min_samples` and `max_samples`.

        A single bin means that the pose is certain: Fox's bound is zero, and this returns `min_samples`. nav2_amcl
        returns `max_samples` instead.
        """
        degrees = np.maximum(np.asarray(occupied, dtype=np.float64) - 1, 1e-9)
        spread = 2 / (9 * degrees)
        needed = np.where(degrees >= 1, degrees / (2 * self.error) * (1 - spread + np.sqrt(spread) * self.z) ** 3, 0)
        return np.clip(np.ceil(needed), self.min_samples, self.max_samples).astype(np.int64)

    def sufficient_count(self, keys: Keys) -> int | None:
        """Return how many of n samples are sufficient, given their bins (n,) in order; None if n are not sufficient."""
        if len(keys) == self.min_samples:  # no smaller number can be sufficient
            return self.min_samples if self.min_samples >= self.samples(len(np.unique(keys))) else None
        is_new = np.zeros(len(keys), dtype=np.int64)
        is_new[np.unique(keys, return_index=True)[1]] = 1
        counts = np.arange(1, len(keys) + 1)
        satisfied = counts >= self.samples(np.cumsum(is_new))
        return int(counts[satisfied.argmax()]) if satisfied.any() else None


def kld_sampling(draw: Callable[[int], Array], bound: KldBound) -> Array:
    """Draw poses (n, 3) with `draw(count)` until the KLD bound is satisfied. Rows may have more than three columns.

    Fox (2003), table 3, but in blocks instead of one by one: the sequence of poses is cut where it first satisfies the
    bound. For this, `draw` must return its poses in random order.
    """
    poses = draw(bound.min_samples)
    while (count := bound.sufficient_count(bin_keys(poses))) is None:
        poses = np.concatenate((poses, draw(min(len(poses), bound.max_samples - len(poses)))))
    return poses[:count]


PROBE_COUNT = 200
"""Number of random poses at which each scan is evaluated."""
MIN_BETTER_FRACTION = 0.1
"""The filter is lost only if at least this fraction of random poses fits recent scans better than the particles."""
MAX_STRAY_SCANS = 4.0
"""Random particles and their descendants ("strays") are limited to the number that this many scans may add."""
_MAX_LOG_RATIO = 50.0
"""Maximum logarithm of a likelihood ratio, so that its exponential stays finite."""


class AugmentedMcl:
    """Decides how many random particles to add, from a fast and a slow running average of how well scans fit.

    The book and nav2_amcl average the likelihood of the scans. It depends not only on the pose: people, glass, and an
    outdated map lower it although the pose is right, and then good particles are replaced. Here, each scan is also
    evaluated at PROBE_COUNT random poses. The averages are those of a ratio: the likelihood of a scan at the particles,
    divided by its likelihood at the random poses.

    Random particles are added while the fast average is below the slow one and at least MIN_BETTER_FRACTION of the
    random poses fit the recent scans better than the particles. If the sensor model has flat weights, it takes many
    scans to remove wrong particles. Therefore one scan adds at most the fraction `max_fraction`, and random particles
    and their descendants are limited in total; older ones make room for new ones.

    nav2_amcl resets both averages after it has added random particles, so that it stops after a few dozen particles.
    This is not necessary here, because the random particles of the last scan are not part of the ratio.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float, max_fraction: float = 1.0) -> None:
        self.is_enabled, self._max_fraction = alpha_fast > 0, max_fraction
        self._slow, self._fast = RunningAverage(alpha_slow), RunningAverage(alpha_fast)
        self._better_fraction = RunningAverage(alpha_fast)

    def observe(self, tracked: float, anywhere: Array) -> None:
        """Add a scan by its log likelihoods: the mean over the particles (`tracked`), and those at random poses (n,).

        The scale must be the same for all scans, see SensorModel.tempering_exponent.
        """
        best = float(anywhere.max())
        average = best + math.log(float(np.mean(np.exp(anywhere - best)))) if best > -np.inf else -np.inf
        ratio = math.exp(min(tracked - average, _MAX_LOG_RATIO)) if tracked > -np.inf else 0.0
        self._slow.add(ratio)
        self._fast.add(ratio)
        self._better_fraction.add(float(np.mean(anywhere > tracked)))

    @property
    def random_fraction(self) -> float:
        """Fraction of new particles to draw at random: 1 - fast / slow, limited to the maximum; 0 if not lost."""
        slow, fast = self._slow.value, self._fast.value
        if slow <= 0 or self._better_fraction.value < MIN_BETTER_FRACTION:
            return 0.0
        return min(self._max_fraction, max(0.0, 1 - fast / slow))

    def kept_fraction(self, stray_weight: float) -> float:
        """Return the fraction of earlier random particles and descendants to keep, given their weight (0 … 1)."""
        allowed = min(1.0, MAX_STRAY_SCANS * self._max_fraction) - self.random_fraction
        return 1.0 if stray_weight <= allowed else max(0.0, allowed / stray_weight)


class RunningAverage:
    """Average with exponentially decaying weights, or with equal weights if `alpha` is zero.

    The weights are normalized from the first value on (Kingma & Ba, Adam, 2015, section 3).
    """

    def __init__(self, alpha: float) -> None:
        self._alpha, self._sum, self._weight = alpha, 0.0, 0.0

    def add(self, value: float) -> None:
        """Add a value, after multiplying earlier weights by 1 - `alpha`."""
        decay = 1 - self._alpha
        self._sum, self._weight = decay * self._sum + value, decay * self._weight + 1

    @property
    def value(self) -> float:
        """The average, 0 before the first value."""
        return self._sum / self._weight if self._weight else 0.0
