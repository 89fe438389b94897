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
    cumulated = weights.cumsum()
    positions = (np.arange(count) + rng.random()) * (cumulated[-1] / count)
    drawn = cumulated.searchsorted(positions, side="right")
    # The last position can round up to the very end; the last index that has any weight is meant.
    clipped: Indices = np.minimum(drawn, cumulated.searchsorted(cumulated[-1]))
    return clipped


def adaptive(draw: Callable[[int], Array], bound: KldBound) -> Array:
    """Draw poses (n, 3) with `draw(count)` until the KLD bound is satisfied. Rows may have more than three columns.

    Fox (2003), table 3, in blocks instead of one by one: the sequence of draws is cut where it first satisfies the
    bound. `draw` must return its poses in an order that does not matter.
    """
    poses = draw(bound.least)
    while (count := bound.enough(bins(poses))) is None:
        poses = np.concatenate((poses, draw(min(len(poses), bound.most - len(poses)))))
    return poses[:count]
