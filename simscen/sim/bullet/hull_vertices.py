"""Convex hulls of few corners: what Bullet does with a hull costs time for each of them, at every step."""

from weakref import WeakKeyDictionary

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Mesh

MAX_VERTICES = 256
"""Vertices up to which a mesh is taken as it is."""
TOLERANCE_M = 0.001
"""m that a corner which is left out may stand out of the hull of those that are kept."""

_known: "WeakKeyDictionary[Mesh, Array]" = WeakKeyDictionary()


def reduce_hull_vertices(mesh: Mesh) -> Array:
    """Vertices (n, 3) of a mesh, in their order, whose convex hull is that of all of them within STANDS_OUT.

    Found once for each mesh. Of one in a plane, which has no hull in space, all are kept.
    """
    if len(mesh.vertices) <= MAX_VERTICES:
        return mesh.vertices
    if mesh not in _known:
        _known[mesh] = _fewest(mesh.vertices)
    return _known[mesh]


def _fewest(points: Array) -> Array:
    from scipy.spatial import ConvexHull, QhullError

    try:
        # Qhull's W: a point that stands out of a facet by less is not taken for one outside.
        hull = ConvexHull(points, qhull_options=f"Qt W{TOLERANCE_M}")
    except QhullError:
        return points
    corners: Array = points[np.sort(hull.vertices)]
    return corners
