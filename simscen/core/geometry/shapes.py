"""Shapes, solids (placed shapes), bodies (movable groups of solids), and the paths that move bodies.

Boxes, cylinders, capsules and cones are centered at the origin of their frame, with z as their axis. Sizes are in m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, Pose2, Pose3

if TYPE_CHECKING:
    import numpy.typing as npt


@dataclass(frozen=True)
class Box:
    """Box with edge lengths (x, y, z)."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class Cylinder:
    """Cylinder of `radius` and `length` along z."""

    radius: float
    length: float


@dataclass(frozen=True)
class Sphere:
    """Sphere of `radius`."""

    radius: float


@dataclass(frozen=True)
class Capsule:
    """Cylinder of `length` along z with half spheres of the same radius at both ends."""

    radius: float
    length: float


@dataclass(frozen=True)
class Ellipsoid:
    """Ellipsoid with half-axes (x, y, z)."""

    radii: tuple[float, float, float]


@dataclass(frozen=True)
class Cone:
    """Cone with its base circle at -length/2 and its tip at +length/2."""

    radius: float
    length: float


@dataclass(frozen=True)
class Extrusion:
    """Simple polygon, counterclockwise in the xy plane, extruded from z = 0 to `height`."""

    polygon: tuple[tuple[float, float], ...]
    height: float


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangle mesh, possibly concave: `vertices` (n, 3) in m, `faces` (m, 3) counterclockwise."""

    vertices: Array
    faces: npt.NDArray[np.int32]


Shape = Box | Cylinder | Sphere | Capsule | Ellipsoid | Cone | Extrusion | Mesh


@dataclass(frozen=True)
class Solid:
    """Shape at a pose: in the frame of the body, or in the world frame for a solid that belongs to no body."""

    shape: Shape
    pose: Pose3 = Pose3()
    name: str = ""
    friction: float = 1.0
    """Friction coefficient of the surface for rubber wheels; 1 for dry concrete."""


@dataclass(frozen=True)
class Body:
    """Rigid body that can move.

    `pose` is the start pose in the world frame. `solids` are in the frame of the body. `mass` is in kg; 0 if collisions
    do not move the body. `path` is the path that the body follows from the start of the run.
    """

    name: str
    solids: tuple[Solid, ...]
    pose: Pose3 = Pose3()
    mass: float = 0.0
    path: MotionPath | None = None


@dataclass(frozen=True)
class MotionPath:
    """Scripted path of a body through planar poses: at path time `times[k]` (s), the body is at `poses[k]`.

    The path time begins at `phase` (s) and increases after a wait of `start` seconds. `mode` is "once" (stay at the
    end), "loop" (start over), or "back_and_forth". `ease` is the motion between two poses:

    - "linear": constant velocity.
    - "smooth": from rest to rest, with 3 u² - 2 u³ of the distance after the fraction u of the time.
    - "spline": cubic Hermite curve with Catmull-Rom velocities; at rest at both ends, except in a loop.

    Headings take the shorter rotation between two poses.
    """

    times: tuple[float, ...]
    poses: tuple[Pose2, ...]
    mode: str = "once"
    start: float = 0.0
    ease: str = "linear"
    phase: float = 0.0

    def elapsed(self, seconds: float) -> float:
        """Return the path time, `seconds` after the start of the path. The path time also increases in repetitions."""
        return self.phase + max(0.0, seconds - self.start)

    def has_ended(self, seconds: float) -> bool:
        """Return whether the motion has ended, `seconds` after the start of the path."""
        return self.mode == "once" and self.elapsed(seconds) >= self.times[-1]


@dataclass(frozen=True)
class TriangleMesh:
    """One mesh of many solids: `vertices` (n, 3) in m, and `faces` (m, 3).

    `owners` (m,) contains the index of the solid of each face. `names`, `frictions`, and `hulls` have one element per
    solid. `frictions` is empty if all are 1. `hulls` contains the range of vertices of a convex solid, and None for a
    concave solid; `hulls` is empty if convexity was not tested.
    """

    vertices: Array
    faces: npt.NDArray[np.int32]
    owners: npt.NDArray[np.int32]
    names: tuple[str, ...] = field(default=())
    frictions: tuple[float, ...] = ()
    hulls: tuple[slice | None, ...] = ()


MAX_SAGITTA_M = 0.0005
"""Default maximum depth to which a facet cuts into a circle."""
FACET_COUNT_RANGE = (12, 192)
"""Minimum and maximum number of facets of a circle."""


def facet_count(radius: float, max_sagitta: float = MAX_SAGITTA_M) -> int:
    """Return the number of facets that approximate a circle of `radius` m, a multiple of 4 in FACET_COUNT_RANGE.

    A facet cuts at most `max_sagitta` m deep into the circle, if the maximum number of facets allows it.
    """
    fewest, most = FACET_COUNT_RANGE
    needed = math.pi / math.acos(1 - max_sagitta / radius) if radius > max_sagitta else fewest
    return int(min(most, max(fewest, 4 * math.ceil(needed / 4))))
