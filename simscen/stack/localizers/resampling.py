"""Resampling of particles. KLD sampling adapts the number of particles.

Source: Fox, Adapting the Sample Size in Particle Filters Through KLD-Sampling, IJRR 22 (2003), equation 7;
Probabilistic Robotics, table 8.4. The histogram has the bins of nav2_amcl (pf_kdtree.c): 0.5 m x 0.5 m x 10°.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

Integers = npt.NDArray[np.int64]


def systematic_resampling(weights: Array, count: int, rng: np.random.Generator) -> Integers:
    """Return ascending indices (count,), drawn in proportion to `weights` (n,).

    Source: the low-variance sampler of Probabilistic Robotics, table 4.4.
    """
    cumulative = weights.cumsum()
    positions = (np.arange(count) + rng.random()) * (cumulative[-1] / count)
    drawn = cumulative.searchsorted(positions, side="right")
    # The last position can be rounded up to the total weight. It then belongs to the last index with a weight.
    clipped: Integers = np.minimum(drawn, cumulative.searchsorted(cumulative[-1]))
    return clipped


BIN_SIZE_M = 0.5
"""Edge length of a histogram bin."""
YAW_BINS = 36
"""Number of histogram bins of the heading, 10° each."""
_OFFSET = 1 << 21
"""Number that is added to the coordinates x and y of a bin for its key, so that both are positive."""


def bin_keys(poses: Array) -> Integers:
    """Return the keys (n,) of the histogram bins of `poses` (n, 3). Headings need not be wrapped."""
    cells = np.clip(np.floor(poses[:, :2] / BIN_SIZE_M), -_OFFSET + 2, _OFFSET - 2).astype(np.int64)
    yaw = np.floor(poses[:, 2] * (YAW_BINS / (2 * np.pi))).astype(np.int64) % YAW_BINS
    return encode_bins(cells[:, 0], cells[:, 1], yaw)


def encode_bins(x: Integers, y: Integers, yaw: Integers) -> Integers:
    """Return the keys (n,) of bins with these integer coordinates (n,)."""
    return ((x + _OFFSET) * (2 * _OFFSET) + (y + _OFFSET)) * YAW_BINS + yaw


def decode_bins(keys: Integers) -> tuple[Integers, Integers, Integers]:
    """Return the integer coordinates x, y, yaw (each (n,)) of bins with these keys (n,)."""
    cells, yaw = np.divmod(keys, YAW_BINS)
    x, y = np.divmod(cells, 2 * _OFFSET)
    return x - _OFFSET, y - _OFFSET, yaw


@dataclass(frozen=True)
class KldBound:
    """Bound on the number of samples, so that their distribution differs from the true distribution by a limited error.

    error:  maximum Kullback-Leibler divergence
    z:      quantile of the standard normal distribution for the required probability; as in nav2_amcl, the parameter
            `pf_z` (default 0.99) is the quantile itself, not the probability
    """

    error: float
    z: float
    min_samples: int
    max_samples: int

    def samples(self, occupied: npt.ArrayLike) -> Integers:
        """Return the required number of samples for each number of occupied bins.

        The result is between `min_samples` and `max_samples`. For a single bin, it is `min_samples`.
        """
        degrees = np.maximum(np.asarray(occupied, dtype=np.float64) - 1, 1e-9)
        spread = 2 / (9 * degrees)
        needed = np.where(degrees >= 1, degrees / (2 * self.error) * (1 - spread + np.sqrt(spread) * self.z) ** 3, 0)
        return np.clip(np.ceil(needed), self.min_samples, self.max_samples).astype(np.int64)

    def sufficient_count(self, keys: Integers) -> int | None:
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

    Source: Fox (2003), table 3. Here, poses are drawn in blocks. `draw` must return poses in random order.
    """
    poses = draw(bound.min_samples)
    while (count := bound.sufficient_count(bin_keys(poses))) is None:
        poses = np.concatenate((poses, draw(min(len(poses), bound.max_samples - len(poses)))))
    return poses[:count]
