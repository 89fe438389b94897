"""KLD sampling: the number of particles adapts to their spread.

KLD-sampling: Fox, Adapting the Sample Size in Particle Filters Through KLD-Sampling, IJRR 22 (2003), equation 7;
Probabilistic Robotics, table 8.4. The histogram is nav2_amcl's (pf_kdtree.c): bins of 0.5 m x 0.5 m x 10°.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

BIN_SIZE_M = 0.5
YAW_BINS = 36
_OFFSET = 1 << 21
"""Number added to the x and y of a bin so that both are positive in its key."""
Keys = npt.NDArray[np.int64]


def bins(poses: Array) -> Keys:
    """Return the keys (n,) of the histogram bins of `poses` (n, 3). Headings a full turn apart share one."""
    cells = np.clip(np.floor(poses[:, :2] / BIN_SIZE_M), -_OFFSET + 2, _OFFSET - 2).astype(np.int64)
    yaw = np.floor(poses[:, 2] * (YAW_BINS / (2 * np.pi))).astype(np.int64) % YAW_BINS
    return join(cells[:, 0], cells[:, 1], yaw)


def join(x: Keys, y: Keys, yaw: Keys) -> Keys:
    """Return the keys of bins with these integer coordinates."""
    return ((x + _OFFSET) * (2 * _OFFSET) + (y + _OFFSET)) * YAW_BINS + yaw


def split(keys: Keys) -> tuple[Keys, Keys, Keys]:
    """Return the integer coordinates x, y, yaw of bins."""
    cells, yaw = np.divmod(keys, YAW_BINS)
    x, y = np.divmod(cells, 2 * _OFFSET)
    return x - _OFFSET, y - _OFFSET, yaw


@dataclass(frozen=True)
class KldBound:
    """Number of samples that keep the sampled distribution within `error` of the true one.

    `z` is an upper quantile of the standard normal distribution. nav2_amcl uses its parameter pf_z = 0.99 as this
    quantile itself, not as the probability 0.99 (whose quantile is 2.33), and so does this.
    """

    error: float
    z: float
    min_samples: int
    max_samples: int

    def samples(self, occupied: npt.ArrayLike) -> Keys:
        """Return the samples needed for a number of occupied bins, between `min_samples` and `max_samples`.

        For a single bin, Fox's bound is zero, so this returns `min_samples`: one bin means that the pose is certain.
        nav2_amcl uses `max_samples` there.
        """
        degrees = np.maximum(np.asarray(occupied, dtype=np.float64) - 1, 1e-9)
        spread = 2 / (9 * degrees)
        needed = np.where(degrees >= 1, degrees / (2 * self.error) * (1 - spread + np.sqrt(spread) * self.z) ** 3, 0)
        return np.clip(np.ceil(needed), self.min_samples, self.max_samples).astype(np.int64)

    def sufficient_count(self, keys: Keys) -> int | None:
        """Return the first sufficient number of samples, given their bins (n,) in order; None if there is none."""
        if len(keys) == self.min_samples:  # no smaller number can be sufficient
            return self.min_samples if self.min_samples >= self.samples(len(np.unique(keys))) else None
        is_new = np.zeros(len(keys), dtype=np.int64)
        is_new[np.unique(keys, return_index=True)[1]] = 1
        counts = np.arange(1, len(keys) + 1)
        satisfied = counts >= self.samples(np.cumsum(is_new))
        return int(counts[satisfied.argmax()]) if satisfied.any() else None
