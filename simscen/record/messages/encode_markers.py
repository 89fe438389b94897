"""Encoder of visualization_msgs/msg/MarkerArray, and functions that compute the points of markers."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.peer.cdr import Writer

Color = tuple[float, float, float, float]
"""Red, green, blue, and opacity, from 0 to 1."""
ARROW, LINE_LIST, TEXT, TRIANGLE_LIST = 0, 5, 9, 11
"""Values of `type` of visualization_msgs/msg/Marker."""
_ADD, _DELETE_ALL = 0, 3
"""Values of `action` of visualization_msgs/msg/Marker."""


class Marker(NamedTuple):
    """Fields of visualization_msgs/msg/Marker.

    frame:   name of the frame that the marker moves with
    group:   `ns` of the message
    kind:    `type` of the message, such as LINE_LIST
    scale:   `scale` of the message in m; the meaning depends on `kind`
    pose:    pose in `frame`
    points:  (n, 3) in m, relative to `pose`
    text:    text of a marker of the kind TEXT
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
    """Return the bytes of a visualization_msgs/msg/MarkerArray that replaces all previous markers of the topic."""
    markers = list(markers)
    message = Writer().put("I", len(markers) + 1)
    _put_marker(message, Marker("map", "", ARROW, (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 0, _DELETE_ALL)
    for marker_id, marker in enumerate(markers):
        _put_marker(message, marker, marker_id, _ADD)
    return message.done()


def _put_marker(message: Writer, marker: Marker, marker_id: int, action: int) -> None:
    """Append a visualization_msgs/msg/Marker to a message."""
    message.put("iI", 0, 0).string(marker.frame).string(marker.group).put("3i", marker_id, marker.kind, action)
    message.put("7d", *marker.pose).put("3d", *marker.scale).put("4f", *marker.color)
    message.put("iI", 0, 0)  # lifetime: forever
    message.put("B", True).put("I", len(marker.points))  # True: the marker moves with its frame
    if len(marker.points):
        message.align(8)
        message.buffer += np.ascontiguousarray(marker.points, dtype="<f8").tobytes()
    message.put("I", 0)  # no colors per point
    message.string("").put("iI", 0, 0).string("").string("").put("2I", 0, 0)  # no texture
    message.string(marker.text)
    message.string("").string("").put("I", 0).put("B", False)  # no mesh


def outline_edges(outlines: Iterable[Sequence[Sequence[float]]], height: float = 0.0) -> Array:
    """Return the edges of polygons as points (n, 3) of a LINE_LIST, all at `height` in m."""
    edges = [np.empty((0, 3))]
    for outline in outlines:
        corners = np.array(outline, dtype=np.float64)[:, :2]
        raised = np.column_stack((corners, np.full(len(corners), height)))
        edges.append(np.stack((raised, np.roll(raised, -1, axis=0)), axis=1).reshape(-1, 3))
    return np.concatenate(edges)


def rectangle_triangles(corners: Array, height: float = 0.0) -> Array:
    """Return rectangles as points (6n, 3) of a TRIANGLE_LIST, all at `height` in m.

    `corners` (n, 4) are min x, min y, max x, max y of each rectangle.
    """
    points = np.full((len(corners), 6, 3), height)
    points[:, :, :2] = corners[:, [[0, 1], [2, 1], [2, 3], [0, 1], [2, 3], [0, 3]]]
    return points.reshape(-1, 3)
