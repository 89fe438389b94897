"""Speed limits of zones and filter masks (nav2_costmap_2d's SpeedFilter)."""

from simscen.core.environment.costmap_filters import Zones
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.stack.protocols import Surroundings


class SpeedFilter:
    """Speed limits of the current speed zones and speed mask."""

    def __init__(self, surroundings: Surroundings) -> None:
        self._zones, self._mask = surroundings.speed_zones, surroundings.masks.speed
        self.is_used = bool(self._zones) or self._mask is not None
        """Whether there is or was a zone or a mask."""

    def set_zones(self, zones: Zones) -> None:
        """Replace all zones and masks."""
        self._zones, self._mask, self.is_used = zones.speed, zones.masks.speed, True

    def limit(self, pose: Pose2, full_speed: float) -> float | None:
        """Return the lowest limit in m/s at a pose; None without a limit.

        The values of a mask can be percentages of `full_speed`.
        """
        limits = [limit for polygon, limit in self._zones if distance_to_polygon(pose, polygon) == 0.0]
        masked = self._mask.at(pose, full_speed) if self._mask is not None else None
        return min(limits if masked is None else [*limits, masked], default=None)
