"""A static mesh in parts that are near or far as a whole: solids, and tiles of those that a whole map is made of."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.geometry import Array
from simscen.core.geometry.meshes import MAX_CONVEX_FACES
from simscen.core.geometry.shapes import TriangleMesh

EDGE = 4.0
"""m of a tile. Twice the usual reach: a robot has a handful of tiles about it, of some hundred faces each."""

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Parts:
    """Faces `order[starts[k]:starts[k + 1]]` are part k, which belongs to `owners[k]`; parts are sorted by owner.

    `low` and `high` are the corners (n, 3) of each part. One of few faces, which may be convex, is one part.
    """

    order: Indices
    starts: Indices
    owners: Indices
    low: Array
    high: Array

    def faces(self, part: int) -> Indices:
        """The faces of a part, by number."""
        return self.order[self.starts[part] : self.starts[part + 1]]

    def whole(self, part: int) -> bool:
        """Whether a part is all of its solid."""
        return len(self.of(int(self.owners[part]))) == 1

    def of(self, owner: int) -> range:
        """The parts of a solid."""
        first, last = np.searchsorted(self.owners, (owner, owner + 1)).tolist()
        return range(first, last)

    def faces_of(self, owner: int) -> Indices:
        """The faces of a whole solid, by number."""
        parts = self.of(owner)
        return self.order[self.starts[parts.start] : self.starts[parts.stop]]

    def holding(self, place: tuple[float, float, float]) -> list[int]:
        """The solids whose extents a place lies in."""
        filled, first = np.unique(self.owners, return_index=True)
        if not len(filled):
            return []
        low, high = np.minimum.reduceat(self.low, first), np.maximum.reduceat(self.high, first)
        found: list[int] = filled[((low <= place) & (place <= high)).all(axis=1)].tolist()
        return found


@cached_on_instance
def parts_of(mesh: TriangleMesh) -> Parts:
    """The parts of a mesh."""
    corners = mesh.vertices[mesh.faces]
    large = np.bincount(mesh.owners, minlength=len(mesh.names))[mesh.owners] > MAX_CONVEX_FACES
    tiles = np.where(large[:, None], np.floor(corners[:, :, :2].mean(axis=1) / EDGE), 0.0)
    order = np.lexsort((tiles[:, 1], tiles[:, 0], mesh.owners))
    keys = np.column_stack((mesh.owners, tiles))[order]
    starts = np.flatnonzero(np.r_[True, (keys[1:] != keys[:-1]).any(axis=1)]) if len(keys) else np.zeros(0, np.int64)
    low, high = np.empty((0, 3)), np.empty((0, 3))
    if len(keys):
        low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
        high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    owners = mesh.owners[order[starts]].astype(np.int64)
    return Parts(order.astype(np.int64), np.r_[starts, len(keys)].astype(np.int64), owners, low, high)
