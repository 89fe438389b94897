"""A mask of speed limits, as stacks are given one and criteria judge by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from simscen.spec.base import Spec
from simscen.spec.places import MaskFile

if TYPE_CHECKING:
    from simscen.core.environment.costmap_filters import SpeedLimits
    from simscen.core.environment.occupancy_grid import OccupancyGrid


class SpeedMask(Spec):
    """A filter mask of speed limits (nav2_costmap_2d's SpeedFilter and its CostmapFilterInfo).

    What a cell of the mask says is `base + multiplier · value`, its value being 0 … 100 as map_server reads the mask
    (`mode: scale` keeps the grays). Cells of value 0 and unknown ones limit nothing, nor does a limit of 0 or less.
    """

    file: MaskFile
    """Map yaml of the mask, relative to this file; its resolution and origin may differ from the map's."""
    type: Literal["percent", "absolute"] = "percent"
    """Percent of the controller's full speed (CostmapFilterInfo type 1), or m/s (type 2)."""
    base: Annotated[float, Field(ge=-1000, le=1000)] = 0.0
    """CostmapFilterInfo's base: percent or m/s."""
    multiplier: Annotated[float, Field(ge=-1000, le=1000)] = 1.0
    """CostmapFilterInfo's multiplier: percent or m/s for each unit of a cell's value."""

    def over(self, grid: OccupancyGrid) -> SpeedLimits:
        """The limits that it makes of the cells in its file."""
        from simscen.core.environment.costmap_filters import SpeedLimits

        return SpeedLimits(grid, self.type == "percent", self.base, self.multiplier)
