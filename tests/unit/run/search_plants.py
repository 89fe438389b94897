"""Test functions of eight parameters between 0 and 1 that replace runs: 0.4 % of the points fail."""

from collections.abc import Callable

import numpy as np

from simscen.core.geometry import Array

WEIGHTS = np.array([1, 0.7, 0.5, 0.3, 0.2, 0.1, 0.05, 0.02])
CENTER = np.array([0.3, 0.6, 0.2])
PLANTS: dict[str, Callable[[Array], Array]] = {
    "linear": lambda points: points @ WEIGHTS,
    "region": lambda points: -np.linalg.norm(points[..., :3] - CENTER, axis=-1),
    "product": lambda points: points[..., :4].prod(axis=-1),
}
"""A point fails if its value is above the threshold. Some parameters have no effect in `region` and `product`."""


def failure_threshold(plant: Callable[[Array], Array]) -> float:
    """Return the value that 0.4 % of the points exceed."""
    return float(np.quantile(plant(np.random.default_rng(0).random((200_000, 8))), 0.996))
