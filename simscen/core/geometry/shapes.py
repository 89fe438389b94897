"""Solids in space: one list of them feeds physics, rays and map alike.

Every shape is given about its own origin: boxes, cylinders, capsules and cones are centered, their axis is z.
Sizes are in meters.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, Pose2, Pose3

if TYPE_CHECKING:
    import numpy.typing as npt


@dataclass(frozen=True)
class Box:
    """A box with edge lengths (x, y, z)."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class Cylinder:
    """A cylinder of `radius` and `length` along z."""

    radius: float
    length: float


@dataclass(frozen=True)
class Sphere:
    """A ball of `radius`."""

    radius: float


@dataclass(frozen=True)
class Capsule:
    """A cylinder of `length` along z with half balls of the same radius on both ends."""

    radius: float
    length: float


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid with half-axes (x, y, z)."""

    radii: tuple[float, float, float]


@dataclass(frozen=True)
class Cone:
    """A cone with its base circle at -length/2 and its tip at +length/2."""

    radius: float
    length: float


@dataclass(frozen=True)
class Extrusion:
    """A simple polygon, anticlockwise in the xy plane, pulled up from z = 0 to `height`."""

    polygon: tuple[tuple[float, float], ...]
    height: float


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles as they are, concave ones too: `vertices` (n, 3) in meters, `faces` (m, 3) anticlockwise."""

    vertices: Array
    faces: npt.NDArray[np.int32]


Shape = Box | Cylinder | Sphere | Capsule | Ellipsoid | Cone | Extrusion | Mesh


@dataclass(frozen=True)
class Solid:
    """A shape at a place: `pose` is the shape's frame in the frame of whatever owns the solid."""

    shape: Shape
    pose: Pose3 = Pose3()
    name: str = ""
    friction: float = 1.0
    """Of its surface against the wheels' rubber, which is 1 on dry concrete."""


@dataclass(frozen=True)
class Body:
    """Something that can move as one piece.

    `pose` is where it starts, `solids` are placed in its own frame. `mass` in kg; 0 means that nothing but the
    scenario moves it. `path` scripts its motion.
    """

    name: str
    solids: tuple[Solid, ...]
    pose: Pose3 = Pose3()
    mass: float = 0.0
    path: MotionPath | None = None


@dataclass(frozen=True)
class MotionPath:
    """A path through planar poses: at `times[k]` (s, on its own clock) something that follows it is at `poses[k]`.

    Its clock stands at `phase` until `start` seconds after it was set off, and runs from then on. `mode`: "once" stays
    at the end, "loop" starts over, "back_and_forth" turns around. `ease` is how it goes from one pose to the next:

    - "linear": evenly.
    - "smooth": from rest to rest, by 3 u² - 2 u³ of the way after the share u of the time; 1.5 times as fast as
      evenly where it is fastest.
    - "spline": along a cubic Hermite curve, whose velocity at pose k is that of Catmull and Rom for uneven times,
      (p[k+1] - p[k-1]) / (t[k+1] - t[k-1]); at rest at both ends, but across the seam of a loop. Headings, too.

    Headings turn the shorter way from each pose to the next.
    """

    times: tuple[float, ...]
    poses: tuple[Pose2, ...]
    mode: str = "once"
    start: float = 0.0
    ease: str = "linear"
    phase: float = 0.0

    def elapsed(self, seconds: float) -> float:
        """What its clock shows `seconds` after it was set off, turning around and starting over not counted."""
        return self.phase + max(0.0, seconds - self.start)

    def over(self, seconds: float) -> bool:
        """Whether nothing moves along it any more, `seconds` after it was set off."""
        return self.mode == "once" and self.elapsed(seconds) >= self.times[-1]


@dataclass(frozen=True)
class TriangleMesh:
    """Many solids fused: `vertices` (n, 3), `faces` (m, 3) and, for each face, the index of its owner in `names`.

    `frictions` are those of the solids' surfaces, by the same index; empty where all are 1. `hulls` are the vertices
    of solids that are convex for sure, None of others; empty where nobody has asked.
    """

    vertices: Array
    faces: npt.NDArray[np.int32]
    owners: npt.NDArray[np.int32]
    names: tuple[str, ...] = field(default=())
    frictions: tuple[float, ...] = ()
    hulls: tuple[slice | None, ...] = ()
