"""Filter mask of speed limits, for stacks and criteria."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from simscen.spec.base import Spec
from simscen.spec.places import MaskFile

if TYPE_CHECKING:
    from simscen.core.environment.costmap_filters import SpeedLimits
    from simscen.core.environment.occupancy_grid import OccupancyGrid


class SpeedMask(Spec):
    """Filter mask of speed limits, as for nav2_costmap_2d's SpeedFilter and its CostmapFilterInfo.

    The limit of a cell is `base + multiplier · value` with a value of 0 … 100 as map_server reads the mask (`mode:
    scale` keeps shades of gray). Cells with value 0, unknown cells, and limits of 0 or less have no effect.
    """

    file: MaskFile
    """Map YAML file of the mask, relative to this file. Its resolution and origin may differ from those of the map."""
    type: Literal["percent", "absolute"] = "percent"
    """Unit of the limits: percent of the controller's full speed (CostmapFilterInfo type 1), or m/s (type 2)."""
    base: Annotated[float, Field(ge=-1000, le=1000)] = 0.0
    """Limit at value 0 (base of CostmapFilterInfo): percent or m/s."""
    multiplier: Annotated[float, Field(ge=-1000, le=1000)] = 1.0
    """Increase of the limit per unit of value (multiplier of CostmapFilterInfo): percent or m/s."""

    def over(self, grid: OccupancyGrid) -> SpeedLimits:
        """Return the speed limits for the cells of the mask."""
        from simscen.core.environment.costmap_filters import SpeedLimits

        return SpeedLimits(grid, self.type == "percent", self.base, self.multiplier)
