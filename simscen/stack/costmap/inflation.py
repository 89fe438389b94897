"""Inflation of obstacles (nav2_costmap_2d's inflation layer): costs by the distance to the nearest lethal cell."""

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.distance_transform import OUT_OF_REACH
from simscen.stack.costmap.grid_frame import Mask
from simscen.stack.protocols import FREE, INSCRIBED, LETHAL, MAX_NON_OBSTACLE, NO_INFORMATION, RobotModel

DISTANCE_MARGIN_M = 0.5
"""Distances are computed up to the inflation radius or, if larger, the circumscribed radius plus this margin."""

Costs = npt.NDArray[np.uint8]
"""Costs 0 to 255 of cells (rows, columns)."""


class Inflation:
    """Lookup tables of distances and costs by squared distance in cells.

    Between inscribed and inflation radius, the cost is 252 · exp(-scaling · (distance - inscribed)), as in computeCost
    of nav2_costmap_2d/inflation_layer.hpp.

    meters:       distances in m, at most `reach_m`
    cost:         costs
    reach_cells:  the distance `reach_m` in cells
    """

    def __init__(
        self, resolution: float, inscribed: float, inflation_radius: float, scaling: float, reach_m: float
    ) -> None:
        self.reach_cells = max(2, math.ceil(reach_m / resolution))  # at least the neighbors of a wall
        distance = np.sqrt(np.arange(OUT_OF_REACH + 1)) * resolution
        self.meters: npt.NDArray[np.float32] = np.minimum(distance, reach_m).astype(np.float32)
        decay = MAX_NON_OBSTACLE * np.exp(-scaling * np.maximum(distance - inscribed, 0.0))
        cost = np.where(distance <= inscribed, INSCRIBED, decay)
        cost = np.where(distance > inflation_radius, FREE, cost)
        cost[0] = LETHAL
        self.cost: Costs = cost.astype(np.uint8)

    def costs(self, squared: npt.NDArray[np.integer], unknown: Mask | None) -> Costs:
        """Return the costs of cells at squared distances. `unknown` cells are unknown, unless inscribed or lethal."""
        cost = self.cost.take(squared)
        if unknown is not None:
            cost[unknown & (cost < INSCRIBED)] = NO_INFORMATION
        return cost


_shared_inflation = lru_cache(maxsize=8)(Inflation)


def inflation_for(spec: CostmapSpec, robot: RobotModel, resolution: float) -> Inflation:
    """Return the lookup tables of a costmap with this resolution in m, cached for all costmaps and runs."""
    reach = max(spec.inflation_radius, robot.circumscribed_radius + DISTANCE_MARGIN_M)
    return _shared_inflation(resolution, robot.inscribed_radius, spec.inflation_radius, spec.cost_scaling_factor, reach)
