"""Speed limits by position, like nav2_costmap_2d's SpeedFilter."""

from simscen.core.environment.costmap_filters import Zones
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.stack.protocols import Surroundings


class SpeedFilter:
    """The current speed zones and speed mask."""

    def __init__(self, surroundings: Surroundings) -> None:
        """Start with the zones and the mask that the stack was configured with."""
        self._zones, self._mask = surroundings.speed_zones, surroundings.masks.speed
        self.used = bool(self._zones) or self._mask is not None
        """Whether there is or was a speed limit."""

    def set_zones(self, zones: Zones) -> None:
        """Replace all zones and masks."""
        self._zones, self._mask, self.used = zones.speed, zones.masks.speed, True

    def limit(self, pose: Pose2, full_speed: float) -> float | None:
        """Return the lowest limit in m/s at a pose, or None. `full_speed` is the controller's speed without limits."""
        limits = [limit for polygon, limit in self._zones if distance_to_polygon(pose, polygon) == 0.0]
        masked = self._mask.at(pose, full_speed) if self._mask is not None else None
        return min(limits if masked is None else [*limits, masked], default=None)
