"""Base class of all stack specifications: the parameters that the simulation and the criteria use."""

from typing import Annotated

from pydantic import Field

from simscen.spec.base import Spec, Typed, by_default
from simscen.spec.places import MaskFile, RegionName
from simscen.spec.quantities import Frequency, PositiveAngle, PositiveLength, PositiveSpeed
from simscen.spec.speed_mask import SpeedMask


class GoalTolerances(Spec):
    """Tolerances of goals that do not have their own, for the stack and for criteria."""

    xy_goal_tolerance: PositiveLength = 0.25
    """Distance from the goal within which the goal counts as reached."""
    yaw_goal_tolerance: PositiveAngle = 0.25
    """Heading error within which the goal counts as reached."""


class SpeedZone(Spec):
    """Region with a speed limit (nav2_costmap_2d's SpeedFilter)."""

    region: RegionName
    """Name of a region of the world."""
    speed_limit: PositiveSpeed
    """Speed limit while the robot's estimated position is in the region."""


class StackBase(Spec):
    """Parameters of every stack."""

    controller_frequency: Frequency = 20.0
    """Rate at which the stack computes commands."""
    goal_checker: GoalTolerances = by_default()
    """Tolerances of goals that do not have their own."""
    keepout: Annotated[list[RegionName], Field(max_length=100)] = []
    """Regions of the world that the robot must not enter (nav2_costmap_2d's KeepoutFilter)."""
    speed_zones: Annotated[list[SpeedZone], Field(max_length=100)] = []
    """Regions of the world with a speed limit."""
    keepout_mask: MaskFile | None = None
    """Map YAML file of a filter mask whose occupied cells are lethal in the costmap (nav2_costmap_2d's KeepoutFilter).
    """
    speed_mask: SpeedMask | None = None
    """Filter mask of speed limits."""

    @property
    def gets_ground_truth(self) -> bool:
        """Whether the stack receives the true pose."""
        return False


Weight = Annotated[float, Field(ge=0, le=1e7)]
"""Weight of a critic relative to other critics."""


class ControllerSpec(Typed):
    """Base class of controller specifications."""

    @property
    def lookahead_s(self) -> float:
        """Time horizon of the commands in seconds; the local costmap is large enough for it."""
        return 2.0
