"""How near a robot can be to things."""

from simscen.core.polygons import distance_to_segment
from simscen.core.world import Polygon
from simscen.loading.loaded import LoadedScenario
from simscen.run.worldsource import load_robot
from simscen.sim.ground import refuse_dragging


def inscribed_radius(radius: float | None, footprint: Polygon) -> float:
    """The largest circle about the base's origin inside a robot's footprint, in metres; a round one is its own."""
    if radius is not None:
        return radius
    ends = (*footprint[1:], footprint[0])
    return min(distance_to_segment(0.0, 0.0, a, b) for a, b in zip(footprint, ends, strict=True))


def inscribed_radius_of(loaded: LoadedScenario) -> float:
    """That of a scenario's robot. Raises InvalidInput for a robot that cannot be used.

    One of simple shapes whose file says how much ground it covers need not be built for that.
    """
    spec = loaded.robot.spec
    if spec is not None and spec.body is not None and (spec.radius is not None or spec.footprint is not None):
        refuse_dragging(spec, loaded.robot.path)
        return inscribed_radius(spec.radius, tuple((x, y) for x, y in spec.footprint or ()))
    body = load_robot(loaded)[1]
    return inscribed_radius(body.radius, body.footprint)
