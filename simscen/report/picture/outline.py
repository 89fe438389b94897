"""What things look like from above."""

from collections.abc import Mapping, Sequence

import numpy as np

from simscen.core.events import Event, EventKind
from simscen.core.geometry import Array, Pose2
from simscen.core.shapes import Body, Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Sphere
from simscen.core.trace import Trace

_UNKNOWN_RADIUS = 0.2


def outlines(trace: Trace, bodies: Sequence[Body]) -> dict[str, Array]:
    """The outline (n, 2) of each object in its own frame: from the world's bodies and from what was spawned."""
    found = {body.name: of_body(body) for body in bodies if body.solids}
    found.update({event.name: of_event(event) for event in trace.of_kind(EventKind.OBJECT_SPAWNED)})
    for name in trace.objects:
        found.setdefault(name, _circle(_UNKNOWN_RADIUS))
    return found


def of_body(body: Body) -> Array:
    """The outline of its largest solid."""
    return max((solid_pose_applied(solid.shape, solid.pose.plane) for solid in body.solids), key=_area)


def solid_pose_applied(shape: Shape, pose: Pose2) -> Array:
    """The outline of a shape that stands at `pose`."""
    return pose.apply(of_shape(shape))


def of_shape(shape: Shape) -> Array:
    """The outline of a shape in its own frame, seen along z; of a mesh its bounding rectangle."""
    match shape:
        case Box(size):
            return _rectangle(size[0], size[1])
        case Cylinder(radius, _) | Sphere(radius) | Capsule(radius, _) | Cone(radius, _):
            return _circle(radius)
        case Ellipsoid(radii):
            return _circle(1.0) * np.array(radii[:2], dtype=np.float64)
        case Extrusion(polygon, _):
            return np.array(polygon, dtype=np.float64)
        case Mesh(vertices, _):
            (x0, y0), (x1, y1) = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
            return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def of_event(event: Event) -> Array:
    """The outline that an object.spawned event describes: its largest part, or `shape` with `size` or `points`."""
    size, points = _floats(event.data, "size"), event.data.get("points")
    parts = event.data.get("parts")
    if isinstance(parts, list) and parts:
        return max((np.array(part, dtype=np.float64) for part in parts), key=_area)
    match event.data.get("shape"):
        case "box" if len(size) >= 2:
            return _rectangle(size[0], size[1])
        case "cylinder" if size:
            return _circle(size[0])
        case "polygon" if isinstance(points, list) and len(points) > 2:
            return np.array(points, dtype=np.float64)
        case _:
            return _circle(_UNKNOWN_RADIUS)


def pose_of(event: Event) -> Pose2:
    """Where an object.spawned event puts the object."""
    x, y, yaw = (event.data.get(key, 0.0) for key in ("x", "y", "yaw"))
    assert isinstance(x, int | float) and isinstance(y, int | float) and isinstance(yaw, int | float)
    return Pose2(float(x), float(y), float(yaw))


def _floats(data: Mapping[str, object], key: str) -> list[float]:
    value = data.get(key)
    return [float(part) for part in value if isinstance(part, int | float)] if isinstance(value, list) else []


def _rectangle(length: float, width: float) -> Array:
    x, y = length / 2, width / 2
    return np.array([(-x, -y), (x, -y), (x, y), (-x, y)])


def _circle(radius: float) -> Array:
    angles = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    return radius * np.column_stack((np.cos(angles), np.sin(angles)))


def _area(polygon: Array) -> float:
    x, y = polygon.T
    return abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))) / 2
