"""The distance field as planners ask it: one point at a time, thousands of times a plan."""

import math
from typing import Any

import numpy as np

from simscen.stack.protocols import CostmapView


class Field:
    """Clearances of a costmap, by plain look-ups: a memoryview answers in a tenth of numpy's time for a scalar."""

    def __init__(self, costmap: CostmapView) -> None:
        self.costmap = costmap
        self.resolution = costmap.resolution
        self.height, self.width = costmap.distance.shape
        self.origin = costmap.origin
        self._per_meter = 1.0 / costmap.resolution
        flat: Any = np.ascontiguousarray(costmap.distance).reshape(-1)
        self._look: Any = memoryview(flat)

    def at(self, x: float, y: float) -> float:
        """Distance in meters to the nearest lethal cell; -1 off the map."""
        column = math.floor((x - self.origin[0]) * self._per_meter)
        row = math.floor((y - self.origin[1]) * self._per_meter)
        if 0 <= row < self.height and 0 <= column < self.width:
            return float(self._look[row * self.width + column])
        return -1.0
