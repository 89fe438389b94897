"""Where the robot must drive slowly (nav2's speed filter)."""

from simscen.core.environment.costmap_filters import Zones
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.stack.protocols import Surroundings


class SpeedFilter:
    """The speed zones and the speed mask that a stack is installed with."""

    def __init__(self, surroundings: Surroundings) -> None:
        self._zones, self._mask = surroundings.speed_zones, surroundings.masks.speed
        self.used = bool(self._zones) or self._mask is not None
        """Whether anything has been limited so far."""

    def set_zones(self, zones: Zones) -> None:
        """From now on these hold; where there are none any more, a limit has to be lifted once."""
        self._zones, self._mask, self.used = zones.speed, zones.masks.speed, True

    def limit(self, pose: Pose2, full_speed: float) -> float | None:
        """The lowest limit in m/s where the robot believes itself; None outside all. `full_speed` is without limits."""
        limits = [limit for polygon, limit in self._zones if distance_to_polygon(pose, polygon) == 0.0]
        masked = self._mask.at(pose, full_speed) if self._mask is not None else None
        return min(limits if masked is None else [*limits, masked], default=None)
