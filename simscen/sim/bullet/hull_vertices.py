"""Reduces the vertices of convex hulls, because each vertex costs Bullet time at every step."""

from weakref import WeakKeyDictionary

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Mesh

MAX_VERTICES = 256
"""Number of vertices above which a mesh is reduced."""
TOLERANCE_M = 0.001
"""Largest distance in m of an omitted vertex from the reduced hull."""

_cache: "WeakKeyDictionary[Mesh, Array]" = WeakKeyDictionary()


def reduce_hull_vertices(mesh: Mesh) -> Array:
    """Return vertices (n, 3) of a mesh, in order, whose convex hull deviates from that of all by at most TOLERANCE_M.

    The result is cached for each mesh. A planar mesh, which has no hull in space, is not reduced.
    """
    if len(mesh.vertices) <= MAX_VERTICES:
        return mesh.vertices
    if mesh not in _cache:
        _cache[mesh] = _hull_corners(mesh.vertices)
    return _cache[mesh]


def _hull_corners(points: Array) -> Array:
    from scipy.spatial import ConvexHull, QhullError

    try:
        # Qhull's option W: a point that is outside of a facet by less counts as inside.
        hull = ConvexHull(points, qhull_options=f"Qt W{TOLERANCE_M}")
    except QhullError:
        return points
    corners: Array = points[np.sort(hull.vertices)]
    return corners
