"""map.png: the map, the truth, the belief, the plans, the obstacles, and where each criterion failed."""

from simscen.report.picture.compose import draw, write_picture
from simscen.report.picture.scene import Scene, with_robots

__all__ = ["Scene", "draw", "with_robots", "write_picture"]
