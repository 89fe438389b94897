"""Inflation layer: costs from distances to obstacles (nav2_costmap_2d).

Distances are squared numbers of cells (uint16), so that one table lookup gives the distance in m or the cost.
"""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.stack.costmap.distance_transform import (
    MAX_REACH_CELLS,
    OUT_OF_REACH,
    squared_distance_blocks,
    squared_distances_within,
)

FREE, MAX_NON_OBSTACLE, INSCRIBED, LETHAL, NO_INFORMATION = 0, 252, 253, 254, 255
MAX_SQUARED_CELLS = OUT_OF_REACH
"""The largest squared distance: that of 256 cells, 12.8 m at 5 cm."""

Squared = npt.NDArray[np.uint16]
Costs = npt.NDArray[np.uint8]


def squared_distances(lethal: npt.NDArray[np.bool_], reach: int) -> Squared:
    """Return the squared distance of each cell to the nearest lethal cell in cells, exact up to `reach`."""
    if not lethal.any():
        return np.full(lethal.shape, MAX_SQUARED_CELLS, dtype=np.uint16)
    if reach <= MAX_REACH_CELLS:
        return squared_distances_within(lethal, reach)
    squared = np.empty(lethal.shape, dtype=np.uint16)
    for rows, distances in squared_distance_blocks(lethal):
        squared[rows] = np.where(
            distances <= reach * reach, np.minimum(distances, MAX_SQUARED_CELLS), MAX_SQUARED_CELLS
        )
    return squared


@lru_cache(maxsize=8)
def inflation(resolution: float, inscribed: float, radius: float, scaling: float, reach: float) -> "Inflation":
    """Return the lookup tables, which both costmaps of a robot and all its runs share."""
    return Inflation(resolution, inscribed, radius, scaling, reach)


class Inflation:
    """Tables over squared cell distances: `meters` and nav2's exponential `cost`.

    cost = 252 · exp(-cost_scaling_factor · (distance - inscribed_radius)) between the inscribed and the inflation
    radius (nav2_costmap_2d/inflation_layer.hpp, computeCost). Meters end at `reach`.
    """

    def __init__(
        self, resolution: float, inscribed: float, inflation_radius: float, scaling: float, reach: float
    ) -> None:
        distance = np.sqrt(np.arange(MAX_SQUARED_CELLS + 1)) * resolution
        self.meters: npt.NDArray[np.float32] = np.minimum(distance, reach).astype(np.float32)
        decay = MAX_NON_OBSTACLE * np.exp(-scaling * np.maximum(distance - inscribed, 0.0))
        cost = np.where(distance <= inscribed, INSCRIBED, decay)
        cost = np.where(distance > inflation_radius, FREE, cost)
        cost[0] = LETHAL
        self.cost: npt.NDArray[np.uint8] = cost.astype(np.uint8)

    def costs(self, squared: npt.NDArray[np.integer], unknown: npt.NDArray[np.bool_] | None) -> Costs:
        """Return the costs of cells. `unknown` ones stay unknown unless an obstacle is within the inscribed radius."""
        cost = self.cost.take(squared)
        if unknown is not None:
            cost[unknown & (cost < INSCRIBED)] = NO_INFORMATION
        return cost
