"""Where a robot can be at all: on the map that it gets, or in the world."""

from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.grid import OccupancyGrid
from simscen.core.world import World
from simscen.loading.loaded import LoadedScenario
from simscen.run.worldsource import load_map


@dataclass(frozen=True)
class Ground:
    """Without a map the ground goes on beyond the obstacles: BARN's goals lie there."""

    bounds: tuple[float, float, float, float] | None = None
    grid: OccupancyGrid | None = None

    def outside(self, pose: Pose2) -> str | None:
        """What a place is outside of, in words that follow "is"; None on the ground."""
        if self.grid is not None and not self.grid.inside(self.grid.cell_of(np.array([[pose.x, pose.y]])))[0]:
            rows, columns = self.grid.shape
            size = f"{columns * self.grid.resolution:g} m x {rows * self.grid.resolution:g} m"
            return f"outside the map ({size} from ({self.grid.origin.x:g}, {self.grid.origin.y:g}))"
        if self.bounds is None:
            return None
        left, bottom, right, top = self.bounds
        if left <= pose.x <= right and bottom <= pose.y <= top:
            return None
        return f"outside the world ({left:g} … {right:g}, {bottom:g} … {top:g})"


def ground_of(loaded: LoadedScenario, world: World) -> Ground:
    """The map that the robot gets, which for a world without one covers all that is in it."""
    if loaded.map == "none":
        return Ground()
    grid = world.grid if loaded.map is None else load_map(loaded.map)
    return Ground(world.bounds if grid is None else None, grid)
