"""Convex hulls of few corners: what Bullet does with a hull costs time for each of them, at every step."""

import math
from collections.abc import Iterable
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.shapes import Body, Mesh

MANY_CORNERS = 256
"""Vertices up to which a mesh is taken as it is."""
STANDS_OUT = 0.001
"""m that a corner which is left out may stand out of the hull of those that are kept."""
_AT_ONCE = 500

_known: "WeakKeyDictionary[Mesh, Array]" = WeakKeyDictionary()


def few_corners(mesh: Mesh) -> Array:
    """Vertices (n, 3) of a mesh, in their order, whose convex hull is that of all of them within STANDS_OUT.

    Found once for each mesh. Of one in a plane, which has no hull in space, all are kept.
    """
    if len(mesh.vertices) <= MANY_CORNERS:
        return mesh.vertices
    if mesh not in _known:
        _known[mesh] = _fewest(mesh.vertices)
    return _known[mesh]


def thin(bodies: Iterable[Body]) -> None:
    """Find the corners of what the engine will push, once for all runs rather than in each."""
    for body in bodies:
        if body.mass > 0 and body.path is None:
            for solid in body.solids:
                if isinstance(solid.shape, Mesh):
                    few_corners(solid.shape)


def _fewest(points: Array) -> Array:
    """Those that are furthest in some directions, then what stands out of their hull, until nothing does."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners: Array = points[np.sort(ConvexHull(points).vertices)]
    except QhullError:
        return points
    kept = np.unique((corners @ (directions(MANY_CORNERS) / np.ptp(corners, axis=0)).T).argmax(axis=0))
    while len(kept) < len(corners):
        out = _furthest_out(corners, ConvexHull(corners[kept]).equations)
        if not len(out):
            break
        kept = np.union1d(kept, out)
    fewest: Array = corners[kept]
    return fewest


def _furthest_out(corners: Array, faces: Array) -> npt.NDArray[np.int64]:
    """For each face of a hull, given as in ConvexHull.equations, the corner that stands out of it most, if too far."""
    found = []
    for k in range(0, len(faces), _AT_ONCE):
        heights = corners @ faces[k : k + _AT_ONCE, :3].T + faces[k : k + _AT_ONCE, 3]
        furthest = heights.argmax(axis=0)
        found.append(furthest[heights[furthest, np.arange(len(furthest))] > STANDS_OUT])
    return np.unique(np.concatenate(found))


def directions(count: int) -> Array:
    """Unit vectors (count, 3), spread evenly over the sphere (Gonzalez 2010, the Fibonacci lattice)."""
    k = np.arange(count)
    z = 1.0 - (2.0 * k + 1.0) / count
    turn = k * math.pi * (3.0 - math.sqrt(5.0))
    radius = np.sqrt(1.0 - z * z)
    return np.column_stack((radius * np.cos(turn), radius * np.sin(turn), z))
