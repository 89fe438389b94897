"""Resampling of particles."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.stack.localizers.kld import KldBound, bins

Indices = npt.NDArray[np.int64]


def systematic(weights: Array, count: int, rng: np.random.Generator) -> Indices:
    """Return indices (count,), ascending, drawn in proportion to `weights` (n,) with minimum variance.

    The low-variance sampler of Probabilistic Robotics, table 4.4: an index is drawn ⌊count·w⌋ or ⌈count·w⌉ times.
    """
    cumulative = weights.cumsum()
    positions = (np.arange(count) + rng.random()) * (cumulative[-1] / count)
    drawn = cumulative.searchsorted(positions, side="right")
    # The last position can be rounded up to the total; it then belongs to the last index with any weight.
    clipped: Indices = np.minimum(drawn, cumulative.searchsorted(cumulative[-1]))
    return clipped


def adaptive(draw: Callable[[int], Array], bound: KldBound) -> Array:
    """Draw poses (n, 3) with `draw(count)` until the KLD bound is satisfied. Rows may have more than three columns.

    Fox (2003), table 3, in blocks instead of one by one: the sequence of draws is cut where it first satisfies the
    bound. `draw` must return its poses in an order that does not matter.
    """
    poses = draw(bound.min_samples)
    while (count := bound.sufficient_count(bins(poses))) is None:
        poses = np.concatenate((poses, draw(min(len(poses), bound.max_samples - len(poses)))))
    return poses[:count]
