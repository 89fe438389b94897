"""The faces of a large world in lots that lie together, so that one can take what is near."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array

if TYPE_CHECKING:
    import numpy.typing as npt

    Faces = npt.NDArray[np.int32]
    Numbers = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FaceLots:
    """`faces[starts[k]:starts[k + 1]]` are lot k; `low` and `high` are the corners (n, 2) around it."""

    faces: Faces
    starts: Numbers
    low: Array
    high: Array

    def __len__(self) -> int:
        return len(self.low)

    def lot(self, number: int) -> Faces:
        """The faces of a lot."""
        return self.faces[self.starts[number] : self.starts[number + 1]]

    def near(self, x: float, y: float, within: float) -> npt.NDArray[np.bool_]:
        """Which lots may have anything within so many metres of a place."""
        place = (x, y)
        outside = np.maximum(np.maximum(self.low - place, place - self.high), 0.0)
        found: npt.NDArray[np.bool_] = (outside * outside).sum(axis=1) <= within * within
        return found


def lots_of(vertices: Array, faces: Faces, edge: float) -> FaceLots:
    """Faces by the square with an edge of so many metres that their middle lies in."""
    corners = vertices[faces, :2]
    squares = np.floor(corners.mean(axis=1) / edge)
    order = np.lexsort((squares[:, 1], squares[:, 0]))
    starts = np.flatnonzero(np.diff(squares[order], axis=0, prepend=np.nan).any(axis=1))
    if not len(starts):
        return FaceLots(faces, np.zeros(1, np.int64), np.empty((0, 2)), np.empty((0, 2)))
    low = np.minimum.reduceat(corners.min(axis=1)[order], starts)
    high = np.maximum.reduceat(corners.max(axis=1)[order], starts)
    return FaceLots(faces[order], np.r_[starts, len(order)], low, high)
