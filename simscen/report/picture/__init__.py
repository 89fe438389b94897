"""map.png: the map, the truth, the belief, the plans, the obstacles, and where each criterion failed.

Each name is imported when it is asked for: pages take their colours from here, and draw nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simscen.report.picture.compose import draw, parts, write_picture
    from simscen.report.picture.scene import Scene, with_robots

__all__ = ["Scene", "draw", "parts", "with_robots", "write_picture"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = "scene" if name in ("Scene", "with_robots") else "compose"
    return getattr(import_module(f"{__name__}.{home}"), name)
