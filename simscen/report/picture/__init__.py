"""map.png: the map, the truth, the belief, the plans, the obstacles, and where each criterion failed."""

from simscen.report.picture.compose import draw, parts, write_picture
from simscen.report.picture.scene import Scene, with_robots

__all__ = ["Scene", "draw", "parts", "with_robots", "write_picture"]
