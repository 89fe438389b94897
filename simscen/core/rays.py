"""The one thing sensors ask of a ray-casting scene."""

import math
from typing import Protocol

from simscen.core.geometry import Array


class RayCaster(Protocol):
    """Casts rays against everything solid but the robot that asks."""

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """Distances (n,) in metres along unit `directions` (n, 3) from `origins` (n, 3).

        inf where nothing is hit within `reach` metres; who needs to know no more is answered sooner.

        *Given* the same geometry *then* the same distances, bit for bit, whatever was asked before.
        """
        ...
