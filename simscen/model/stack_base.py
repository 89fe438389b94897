"""What the engine and the criteria read of any stack, whoever wrote it."""

from typing import Annotated

from pydantic import Field

from simscen.spec.base import Spec, Typed, by_default
from simscen.spec.places import MaskFile, RegionName
from simscen.spec.quantities import Frequency, PositiveAngle, PositiveLength, PositiveSpeed
from simscen.spec.speed_mask import SpeedMask


class GoalTolerances(Spec):
    """How near is near enough for goals that do not say: the stack is told, and criteria judge by it."""

    xy_goal_tolerance: PositiveLength = 0.25
    """How far from the goal the robot may be."""
    yaw_goal_tolerance: PositiveAngle = 0.25
    """How far from the goal's heading its own may be."""


class SpeedZone(Spec):
    """A part of the world with a speed limit (nav2_costmap_2d's SpeedFilter)."""

    region: RegionName
    """A region of the world, by name."""
    speed_limit: PositiveSpeed
    """While the robot believes itself inside."""


class StackBase(Spec):
    """What every stack is given, and what the engine asks of it."""

    controller_frequency: Frequency = 20.0
    """How often it is asked for a command."""
    goal_checker: GoalTolerances = by_default()
    """Its tolerances are those of goals that name none of their own."""
    keepout: Annotated[list[RegionName], Field(max_length=100)] = []
    """Regions of the world that the robot must not enter (nav2_costmap_2d's KeepoutFilter)."""
    speed_zones: Annotated[list[SpeedZone], Field(max_length=100)] = []
    """Regions of the world with a speed limit."""
    keepout_mask: MaskFile | None = None
    """Map yaml of a filter mask: its occupied cells are lethal to the costmap (nav2_costmap_2d's KeepoutFilter)."""
    speed_mask: SpeedMask | None = None
    """A filter mask of speed limits."""

    @property
    def told_truth(self) -> bool:
        """Whether it is also told where it truly is."""
        return False


# MERGED: What the parameters of all controllers have in common.
Weight = Annotated[float, Field(ge=0, le=1e7)]
"""Of a critic, against other critics."""


class ControllerSpec(Typed):
    """What follows a path."""

    @property
    def looks_ahead(self) -> float:
        """Seconds for which it follows what it may command: the local costmap reaches so far."""
        return 2.0
