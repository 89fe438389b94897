"""Splits the static mesh of a world into parts with bounding boxes, so that distance queries can skip distant parts."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array, Vector
from simscen.core.geometry.meshes import MAX_CONVEX_FACES
from simscen.core.geometry.shapes import TriangleMesh

PART_SIZE_M = 4.0
"""Edge length of the square tiles into which a solid with many faces is split."""

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MeshParts:
    """Parts of a static mesh, sorted by solid. A solid with few faces is one part; a larger solid is split into tiles.

    Part k belongs to the solid with the index `solids[k]`, and has the face indices `order[starts[k]:starts[k + 1]]`.
    The bounding box of part k is from `low[k]` to `high[k]` (x, y, z) in m.
    """

    order: Indices
    starts: Indices
    solids: Indices
    low: Array
    high: Array

    def faces(self, part: int) -> Indices:
        """Return the face indices of a part."""
        return self.order[self.starts[part] : self.starts[part + 1]]

    def parts_of_solid(self, solid: int) -> range:
        """Return the indices of the parts of a solid."""
        first, last = np.searchsorted(self.solids, (solid, solid + 1)).tolist()
        return range(first, last)

    def faces_of_solid(self, solid: int) -> Indices:
        """Return the indices of all faces of a solid."""
        parts = self.parts_of_solid(solid)
        return self.order[self.starts[parts.start] : self.starts[parts.stop]]

    def solids_around(self, point: Vector) -> list[int]:
        """Return the indices of the solids whose bounding box contains a point."""
        solids, first = np.unique(self.solids, return_index=True)
        if not len(solids):
            return []
        low, high = np.minimum.reduceat(self.low, first), np.maximum.reduceat(self.high, first)
        found: list[int] = solids[((low <= point) & (point <= high)).all(axis=1)].tolist()
        return found


@cached_on_instance
def parts_of(mesh: TriangleMesh) -> MeshParts:
    """Return the parts of a mesh. The result is cached."""
    corners = mesh.vertices[mesh.faces]
    is_large = np.bincount(mesh.owners, minlength=len(mesh.names))[mesh.owners] > MAX_CONVEX_FACES
    tiles = np.where(is_large[:, None], np.floor(corners[:, :, :2].mean(axis=1) / PART_SIZE_M), 0.0)
    order = np.lexsort((tiles[:, 1], tiles[:, 0], mesh.owners))
    keys = np.column_stack((mesh.owners, tiles))[order]
    starts = np.flatnonzero(np.r_[True, (keys[1:] != keys[:-1]).any(axis=1)]) if len(keys) else np.zeros(0, np.int64)
    low, high = np.empty((0, 3)), np.empty((0, 3))
    if len(keys):
        low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
        high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    solids = mesh.owners[order[starts]].astype(np.int64)
    return MeshParts(order.astype(np.int64), np.r_[starts, len(keys)].astype(np.int64), solids, low, high)
