"""visualization_msgs/msg/MarkerArray: what a 3D viewer draws, each with the frame that it moves with."""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.record.cdr import Template

Color = tuple[float, float, float, float]
"""Red, green, blue and opacity, 0 … 1."""
ARROW, LINE_LIST, TEXT, TRIANGLE_LIST = 0, 5, 9, 11
_ADD, _DELETE_ALL = 0, 3


class Marker(NamedTuple):
    """One shape: `group` is its namespace, which viewers show and hide by name; `scale` in meters as ROS has it.

    `points` (n, 3) are in the frame of `pose`, which is in `frame`.
    """

    frame: str
    group: str
    kind: int
    color: Color
    scale: tuple[float, float, float]
    pose: Pose3 = Pose3()
    points: Array = np.empty((0, 3))
    text: str = ""


def marker_array(markers: Iterable[Marker]) -> bytes:
    """The message that takes the place of all that its topic said before: who comes late needs the last one only.

    Stamps are zero and frames locked: each marker goes where its frame goes, however long ago it was said.
    """
    shown = list(markers)
    message = Template()
    message.put("I", len(shown) + 1)
    _put(message, Marker("map", "", ARROW, (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 0, _DELETE_ALL)
    for number, marker in enumerate(shown):
        _put(message, marker, number, _ADD)
    return bytes(message.buffer)


def _put(message: Template, marker: Marker, number: int, action: int) -> None:
    message.put("iI", 0, 0)
    message.string(marker.frame)
    message.string(marker.group)
    message.put("3i", number, marker.kind, action)
    message.put("7d", *marker.pose)
    message.put("3d", *marker.scale)
    message.put("4f", *marker.color)
    message.put("iI", 0, 0)  # it stays
    message.put("B", True)
    message.put("I", len(marker.points))
    if len(marker.points):
        message.align(8)
        message.buffer += np.ascontiguousarray(marker.points, dtype="<f8").tobytes()
    message.put("I", 0)  # no colors of single points
    message.string("")  # no texture
    message.put("iI", 0, 0)
    for _ in ("frame", "format"):
        message.string("")
    message.put("2I", 0, 0)  # no image, no coordinates in it
    message.string(marker.text)
    message.string("")  # no mesh
    message.string("")
    message.put("I", 0)
    message.put("B", False)


def rims(outlines: Iterable[Sequence[Sequence[float]]], height: float = 0.0) -> Array:
    """The edges of polygons as the points (n, 3) of a LINE_LIST."""
    edges = [edge for outline in outlines for edge in _edges(np.array(outline, dtype=np.float64), height)]
    return np.concatenate(edges) if edges else np.empty((0, 3))


def boxes(corners: Array, height: float = 0.0) -> Array:
    """Rectangles (n, 4) of least x and y and greatest x and y as the points (6n, 3) of a TRIANGLE_LIST."""
    points = np.full((len(corners), 6, 3), height)
    points[:, :, :2] = corners[:, [[0, 1], [2, 1], [2, 3], [0, 1], [2, 3], [0, 3]]]
    return points.reshape(-1, 3)


def _edges(outline: Array, height: float) -> Iterator[Array]:
    raised = np.column_stack((outline[:, :2], np.full(len(outline), height)))
    yield np.stack((raised, np.roll(raised, -1, axis=0)), axis=1).reshape(-1, 3)
