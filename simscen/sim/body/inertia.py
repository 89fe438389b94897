"""Mass, center of mass and moments of inertia of simple shapes, and of bodies composed of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.shapes import Box, Capsule, Cone, Cylinder, Ellipsoid, Extrusion, Mesh, Shape, Solid, Sphere


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass in kg, center of mass in m, and inertia tensor (3, 3) in kg m² about the center of mass."""

    mass: float
    center: Array
    tensor: Array

    def transformed(self, pose: Pose3) -> "MassProperties":
        """Return the properties in another frame; `pose` is the pose of the current frame in the other frame."""
        turn = pose.rotation()
        return MassProperties(self.mass, pose.apply(self.center[None])[0], turn @ self.tensor @ turn.T)

    def principal(self) -> tuple[Vector, Pose3]:
        """Return the principal moments of inertia in kg m², and the pose of the principal axes."""
        x, y, z = self.center.tolist()
        if np.abs(self.tensor - np.diag(np.diag(self.tensor))).max() <= 1e-9 * np.trace(self.tensor):
            a, b, c = np.diag(self.tensor).tolist()
            return (a, b, c), Pose3(x, y, z)
        moments, axes = np.linalg.eigh(self.tensor)
        axes = axes * np.sign(np.linalg.det(axes))
        a, b, c = moments.tolist()
        return (a, b, c), Pose3(x, y, z, *_quaternion(axes))


def combine(parts: Sequence[MassProperties]) -> MassProperties:
    """Return the properties of a rigid body that consists of `parts` in the same frame (parallel axis theorem)."""
    mass = sum(part.mass for part in parts)
    weighted = np.sum([part.mass * part.center for part in parts], axis=0)
    center = weighted / mass if mass > 0 else np.mean([part.center for part in parts], axis=0)
    tensor = np.sum([part.tensor + part.mass * _parallel_axis_term(part.center - center) for part in parts], axis=0)
    return MassProperties(mass, center, tensor)


def inertia_of_solids(solids: Sequence[Solid], mass: float) -> MassProperties:
    """Return the properties of solids of equal density (equal mass if all are flat) with a total mass of `mass` kg."""
    volumes = [volume(solid.shape) for solid in solids]
    if not any(volumes):
        volumes = [1.0] * len(solids)
    parts = [
        inertia_of_shape(s.shape, mass * v / sum(volumes)).transformed(s.pose)
        for s, v in zip(solids, volumes, strict=True)
    ]
    return combine(parts)


def volume(shape: Shape) -> float:
    """Return the volume of a shape in m³; for a mesh, the volume of its bounding box."""
    match shape:
        case Box(size):
            return math.prod(size)
        case Cylinder(radius, length):
            return math.pi * radius**2 * length
        case Sphere(radius):
            return 4 / 3 * math.pi * radius**3
        case Capsule(radius, length):
            return math.pi * radius**2 * (length + 4 / 3 * radius)
        case Ellipsoid(radii):
            return 4 / 3 * math.pi * math.prod(radii)
        case Cone(radius, length):
            return math.pi * radius**2 * length / 3
        case Extrusion(polygon, height):
            return abs(_polygon_moments(polygon)[0]) * height
        case Mesh(vertices):
            return float(np.prod(np.ptp(vertices, axis=0)))


def inertia_of_shape(shape: Shape, mass: float) -> MassProperties:
    """Return the properties of a shape of uniform density in its own frame. A mesh counts as its bounding box."""
    match shape:
        case Box((x, y, z)):
            return _with_principal_moments(mass, (y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12)
        case Cylinder(radius, length):
            across = (3 * radius**2 + length**2) / 12
            return _with_principal_moments(mass, across, across, radius**2 / 2)
        case Sphere(radius):
            return inertia_of_shape(Ellipsoid((radius, radius, radius)), mass)
        case Ellipsoid((a, b, c)):
            return _with_principal_moments(mass, (b * b + c * c) / 5, (a * a + c * c) / 5, (a * a + b * b) / 5)
        case Capsule(radius, length):
            balls = mass * 4 / 3 * radius / (length + 4 / 3 * radius)
            tube = inertia_of_shape(Cylinder(radius, length), mass - balls)
            across = 2 / 5 * radius**2 + length**2 / 4 + 3 / 8 * length * radius
            halves = _with_principal_moments(balls, across, across, 2 / 5 * radius**2)
            return MassProperties(mass, np.zeros(3), tube.tensor + halves.tensor)
        case Cone(radius, length):
            across = 3 / 80 * (4 * radius**2 + length**2)
            cone = _with_principal_moments(mass, across, across, 3 / 10 * radius**2)
            return MassProperties(mass, np.array([0.0, 0.0, -length / 4]), cone.tensor)
        case Extrusion(polygon, height):
            return _inertia_of_prism(polygon, height, mass)
        case Mesh(vertices):
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            x, y, z = (high - low).tolist()
            return MassProperties(mass, (low + high) / 2, inertia_of_shape(Box((x, y, z)), mass).tensor)


def _with_principal_moments(mass: float, xx: float, yy: float, zz: float) -> MassProperties:
    """Return properties with the center of mass at the origin, from moments of inertia per mass in m²."""
    return MassProperties(mass, np.zeros(3), mass * np.diag([xx, yy, zz]))


def _parallel_axis_term(offset: Array) -> Array:
    """Return the inertia tensor (3, 3) per mass in m² of a point at `offset` (3,) m, about the origin."""
    result: Array = offset @ offset * np.eye(3) - np.outer(offset, offset)
    return result


def _inertia_of_prism(polygon: Sequence[tuple[float, float]], height: float, mass: float) -> MassProperties:
    area, cx, cy, xx, yy, xy = _polygon_moments(polygon)
    xx, yy, xy = xx / area - cx * cx, yy / area - cy * cy, xy / area - cx * cy
    upright = height**2 / 12
    tensor = np.array([[yy + upright, -xy, 0.0], [-xy, xx + upright, 0.0], [0.0, 0.0, xx + yy]])
    return MassProperties(mass, np.array([cx, cy, height / 2]), mass * tensor)


def _polygon_moments(polygon: Sequence[tuple[float, float]]) -> tuple[float, float, float, float, float, float]:
    """Return the area, centroid x, centroid y, ∫x², ∫y², and ∫xy of a simple polygon (Steger 1996)."""
    x, y = np.array(polygon).T
    u, v = np.roll(x, -1), np.roll(y, -1)
    cross = x * v - u * y
    area = cross.sum() / 2
    return (
        float(area),
        float(((x + u) * cross).sum() / (6 * area)),
        float(((y + v) * cross).sum() / (6 * area)),
        float(((x * x + x * u + u * u) * cross).sum() / 12),
        float(((y * y + y * v + v * v) * cross).sum() / 12),
        float(((x * v + 2 * x * y + 2 * u * v + u * y) * cross).sum() / 24),
    )


def _quaternion(rotation: Array) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of a rotation matrix (Shepperd 1978)."""
    diagonal_and_trace = np.array([*np.diag(rotation), np.trace(rotation)])
    k = int(np.argmax(diagonal_and_trace))
    # The axis of the rotation, multiplied by 2 sin(angle).
    scaled_axis = [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    if k == 3:
        q = np.array([*scaled_axis, 1 + diagonal_and_trace[3]])
    else:
        i, j = (k + 1) % 3, (k + 2) % 3
        q = np.empty(4)
        q[k] = 1 - diagonal_and_trace[3] + 2 * rotation[k, k]
        q[i], q[j] = rotation[i, k] + rotation[k, i], rotation[j, k] + rotation[k, j]
        q[3] = scaled_axis[k]
    x, y, z, w = (q / np.linalg.norm(q)).tolist()
    return x, y, z, w
