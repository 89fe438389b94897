"""Where a horizontal plane cuts a mesh: what a level lidar could ever see, and what a map of it shows."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import TriangleMesh


@dataclass(frozen=True, eq=False)
class Section:
    """Directed segments (n, 2, 2) in metres with the solid on their left, and the owner (n,) of each."""

    segments: Array
    owners: npt.NDArray[np.int32]


def outlines(mesh: TriangleMesh, height: float) -> Array:
    """The cut of the mesh at `height` as segments (n, 2, 2): [k, 0] is where segment k begins, [k, 1] its end."""
    return section(mesh, height).segments


def section(mesh: TriangleMesh, height: float) -> Section:
    """The cut of the mesh at `height`; closed loops wherever the mesh is closed.

    A vertex at exactly `height` counts as above it, so a box is cut from its underside (not included) to its top
    (included) and no cut is ever a point or a whole face. Both triangles at an edge compute the same point, bit
    for bit, as both walk the edge upwards.
    """
    above = mesh.vertices[:, 2] >= height
    count = above[mesh.faces].sum(axis=1)
    cut = (count == 1) | (count == 2)
    faces, lone_above = mesh.faces[cut], count[cut] == 1
    lone = np.argmax(above[faces] == lone_above[:, None], axis=1)
    turned = faces[np.arange(len(faces))[:, None], (lone[:, None] + np.arange(3)) % 3]
    tip, left, right = mesh.vertices[turned].swapaxes(0, 1)
    first, second = _crossing(tip, left, height, lone_above), _crossing(tip, right, height, lone_above)
    segments = np.where(lone_above[:, None, None], np.stack((first, second), 1), np.stack((second, first), 1))
    long = np.any(segments[:, 0] != segments[:, 1], axis=1)
    return Section(segments[long], mesh.owners[cut][long])


def _crossing(tip: Array, base: Array, height: float, tip_above: npt.NDArray[np.bool_]) -> Array:
    """Where the edges between `tip` (n, 3) and `base` (n, 3) pass the height, as (n, 2)."""
    low, high = np.where(tip_above[:, None], base, tip), np.where(tip_above[:, None], tip, base)
    along = (height - low[:, 2]) / (high[:, 2] - low[:, 2])
    point: Array = low[:, :2] + along[:, None] * (high - low)[:, :2]
    return point
