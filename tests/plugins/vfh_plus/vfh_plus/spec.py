"""Parameters of the stack in a scenario."""

from typing import ClassVar

from simscen.plugin import Frequency, InProcessStack, NonNegativeLength, PositiveDuration, PositiveLength, PositiveSpeed


class VfhPlus(InProcessStack):
    """Dead reckoning, a wavefront on the map, and VFH+ along it (Ulrich and Borenstein 1998).

    Example: `stack: {type: vfh_plus, top_speed: 0.4 m/s}`
    """

    component: ClassVar[str] = "vfh_plus.stack:VfhPlusStack"
    controller_frequency: Frequency = 10.0
    """How often it steers."""
    top_speed: PositiveSpeed | None = None
    """Default: 0.4 m/s, or what the robot can do if that is less."""
    active_radius: PositiveLength = 1.5
    """How far away an obstacle begins to count."""
    safety: NonNegativeLength = 0.06
    """Room that is kept around the hull."""
    memory: PositiveDuration = 1.5
    """How long an obstacle counts after it was last seen."""
    patience: PositiveDuration = 12.0
    """Without progress for so long, the goal has failed."""
