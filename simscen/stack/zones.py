"""Speed zones: where the robot must drive slowly (nav2's speed filter)."""

from simscen.core.geometry import Pose2
from simscen.core.polygons import distance_to_polygon
from simscen.core.world import Polygon


def speed_limit(zones: tuple[tuple[Polygon, float], ...], pose: Pose2) -> float | None:
    """The lowest limit in m/s of the zones that the pose lies in; None outside all."""
    limits = [limit for polygon, limit in zones if distance_to_polygon(pose, polygon) == 0.0]
    return min(limits, default=None)
