"""`move`: let an object follow waypoints."""

import itertools
import math
from typing import Annotated, Literal

from pydantic import Field

from simscen.actions.base import Action
from simscen.core.geometry import Pose2
from simscen.core.shapes import MotionPath
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.places import Point
from simscen.spec.quantities import PositiveSpeed
from simscen.spec.references import MovableName


class Move(Spec, Action):
    """Let an object drive along straight lines from where it is through waypoints at a constant speed.

    It does not stop for the robot, and it faces where it drives.

    Example: `do: {move: {name: cart, through: [[4, 1], [4, 5]], speed: 1 m/s, repeat: back_and_forth}}`
    """

    name: MovableName
    """The object to move."""
    through: Annotated[list[Point], Field(min_length=1, max_length=1000)]
    """Waypoints [x, y] in the world frame."""
    speed: PositiveSpeed
    """Along the lines."""
    repeat: Literal["once", "loop", "back_and_forth"] = "once"
    """At the last waypoint: stay, start over from the first position, or turn around."""

    def perform(self, stage: Stage) -> Effect:
        """Set it going; nothing comes of it when it is not there, or stands at its only waypoint."""
        here = stage.object(self.name)
        if here is None:
            return Effect(False, f"there is nothing called {self.name}")
        path = route(here, self.through, self.speed, self.repeat)
        if len(path.poses) == 1:
            return Effect(False, f"{self.name} stands at its waypoint already")
        stage.move(self.name, path)
        return Effect(True, f"moved {self.name}")


def route(start: Pose2, through: list[list[float]], speed: float, repeat: str) -> MotionPath:
    """Times and poses along straight lines; `loop` closes the circle."""
    corners = [(start.x, start.y), *((x, y) for x, y in through)]
    if repeat == "loop":
        corners.append((start.x, start.y))
    times, poses = [0.0], [start]
    for (ax, ay), (bx, by) in itertools.pairwise(corners):
        length = math.hypot(bx - ax, by - ay)
        if length > 0:
            heading = math.atan2(by - ay, bx - ax)
            poses[-1] = Pose2(ax, ay, heading)
            times.append(times[-1] + length / speed)
            poses.append(Pose2(bx, by, heading))
    return MotionPath(tuple(times), tuple(poses), repeat)
