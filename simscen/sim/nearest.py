"""Whose surface a point lies on: the engine knows only fused triangles."""

import numpy as np

from simscen.core.geometry import Array
from simscen.core.shapes import TriangleMesh


class Owners:
    """Finds the owner of the face nearest to a point."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self._mesh = mesh
        self._corners = mesh.vertices[mesh.faces]
        self._low, self._high = self._corners.min(axis=1), self._corners.max(axis=1)

    def name(self, point: tuple[float, float, float], reach: float = 0.1) -> str:
        """The name of the solid whose surface is nearest; empty when there is none within `reach` metres."""
        place = np.array(point)
        near = np.flatnonzero(((self._low - reach <= place) & (place <= self._high + reach)).all(axis=1))
        if not len(near):
            return ""
        distances = point_to_triangles(place, self._corners[near])
        return self._mesh.names[int(self._mesh.owners[near[int(np.argmin(distances))]])]


def point_to_triangles(point: Array, corners: Array) -> Array:
    """Distances (n,) in metres from a point (3,) to triangles (n, 3, 3)."""
    a, b, c = corners.swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    edges = np.min([_to_segments(point, p, q) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    length = np.linalg.norm(normal, axis=1)
    flat = length > 0
    height = np.abs(np.sum((point - a) * normal, axis=1)) / np.where(flat, length, 1.0)
    inside = flat.copy()
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= np.sum(np.cross(q - p, point - p) * normal, axis=1) >= 0
    result: Array = np.where(inside, height, edges)
    return result


def _to_segments(point: Array, start: Array, end: Array) -> Array:
    along = end - start
    squared = np.sum(along * along, axis=1)
    part = np.sum((point - start) * along, axis=1) / np.where(squared > 0, squared, 1.0)
    nearest = start + np.clip(part, 0.0, 1.0)[:, None] * along
    distance: Array = np.linalg.norm(point - nearest, axis=1)
    return distance
