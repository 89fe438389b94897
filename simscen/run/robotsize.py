"""How much room a robot takes."""

import math
from dataclasses import dataclass

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry.polygons import distance_to_segment
from simscen.loading.loaded import LoadedScenario
from simscen.model.robot import RobotSpec
from simscen.run.worldsource import load_robot
from simscen.sim.ground import refuse_dragging
from simscen.sim.robot_body import RobotBody

CORNERS = 24
"""Of the polygon that stands for a round footprint."""


@dataclass(frozen=True)
class RobotSize:
    """Its `footprint` in its base frame, the `radius` of a round one, and the `height` of its hull in metres."""

    footprint: Polygon
    radius: float | None
    height: float

    @property
    def inscribed(self) -> float:
        """Metres: no part of the footprint's edge is nearer to the base's origin."""
        return inscribed_radius(self.radius, self.footprint)


def inscribed_radius(radius: float | None, footprint: Polygon) -> float:
    """The largest circle about the base's origin inside a robot's footprint, in metres; a round one is its own."""
    if radius is not None:
        return radius
    ends = (*footprint[1:], footprint[0])
    return min(distance_to_segment(0.0, 0.0, a, b) for a, b in zip(footprint, ends, strict=True))


def robot_size_of(loaded: LoadedScenario) -> RobotSize:
    """That of a scenario's robot. Raises InvalidInput for a robot that cannot be used.

    One of simple shapes whose file says how much ground it covers need not be built for that.
    """
    spec = loaded.robot.spec
    if spec is not None and spec.body is not None and (spec.radius is not None or spec.footprint is not None):
        refuse_dragging(spec, loaded.robot.path)
        corners = tuple((x, y) for x, y in spec.footprint) if spec.footprint is not None else _round(spec.radius or 0.0)
        return RobotSize(corners, spec.radius, _height_of_shapes(spec))
    body = load_robot(loaded)[1]
    return RobotSize(body.footprint, body.radius, _height_of_hull(body))


def _round(radius: float) -> Polygon:
    turns = [2 * math.pi * k / CORNERS for k in range(CORNERS)]
    return tuple((radius * math.cos(turn), radius * math.sin(turn)) for turn in turns)


def _height_of_shapes(spec: RobotSpec) -> float:
    return max(part.z + part.tall for part in spec.body or ())


def _height_of_hull(body: RobotBody) -> float:
    from simscen.sim.outline import extremes

    return max(float(solid.pose.apply(extremes(solid.shape))[:, 2].max()) for solid in body.hull)
