"""visualization_msgs/msg/MarkerArray: what a 3D viewer draws, each with the frame that it moves with."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from simscen.core.environment.costmap_filters import Filter
from simscen.core.environment.scenery import FilterZone, Scenery
from simscen.core.geometry import Array, Pose3
from simscen.core.records.case import Case
from simscen.core.records.events import Event, EventKind, Value
from simscen.record import frame_names, topics
from simscen.record.frame_names import RobotFrames
from simscen.record.messages.cdr import Template
from simscen.record.publishers.channels import MessageSink

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


def outline_edges(outlines: Iterable[Sequence[Sequence[float]]], height: float = 0.0) -> Array:
    """The edges of polygons as the points (n, 3) of a LINE_LIST."""
    edges = [edge for outline in outlines for edge in _edges(np.array(outline, dtype=np.float64), height)]
    return np.concatenate(edges) if edges else np.empty((0, 3))


def rectangle_triangles(corners: Array, height: float = 0.0) -> Array:
    """Rectangles (n, 4) of least x and y and greatest x and y as the points (6n, 3) of a TRIANGLE_LIST."""
    points = np.full((len(corners), 6, 3), height)
    points[:, :, :2] = corners[:, [[0, 1], [2, 1], [2, 3], [0, 1], [2, 3], [0, 3]]]
    return points.reshape(-1, 3)


def _edges(outline: Array, height: float) -> Iterator[Array]:
    raised = np.column_stack((outline[:, :2], np.full(len(outline), height)))
    yield np.stack((raised, np.roll(raised, -1, axis=0)), axis=1).reshape(-1, 3)


OBJECT_COLOR: Color = (0.0, 0.41, 0.58, 1.0)
PERSON_COLOR: Color = (0.48, 0.24, 0.51, 1.0)
DOOR_COLOR: Color = (0.59, 0.38, 0.0, 1.0)
KEEPOUT_COLOR: Color = (0.76, 0.19, 0.06, 1.0)
SPEED_COLOR: Color = (0.9, 0.62, 0.0, 1.0)
PLACE_COLOR: Color = (0.44, 0.45, 0.49, 1.0)
RAMP_COLOR: Color = (0.66, 0.58, 0.43, 1.0)
TRUTH_COLOR: Color = (0.0, 0.44, 0.34, 1.0)
BELIEF_COLOR: Color = (0.8, 0.2, 0.5, 1.0)
"""Okabe and Ito's hues, as on pages and pictures."""
LINE_SCALE, TEXT_SCALE = (0.03, 0.0, 0.0), (0.0, 0.0, 0.25)
"""Scales: the width of a line and the height of letters in m."""
MAX_MASK_BLOCKS = 2000
"""Blocks of a filter mask that are drawn; the largest come first."""
_MARKER_HEIGHT_M = 0.02  # over the floor, so that the map does not hide it
_TEXT_POSE = Pose3(0.0, 0.0, 0.5)


class ScenePublisher:
    """Writes all that is there to be seen when anything of it has changed; where things are is told by /tf."""

    def __init__(self, out: MessageSink, case: Case, scenery: Scenery, names: RobotFrames, robot: str) -> None:
        self._out, self._case, self._names, self._robot, self._scenery = out, case, names, robot, scenery
        self._doors = {thing.name for thing in scenery.things if thing.closed is not None}
        self._things: dict[str, Event] = {}
        own = (zone for zone in scenery.zones if zone.robot == robot)
        self._zones: dict[tuple[str, str], FilterZone] = {(zone.filter, zone.region): zone for zone in own}
        self.begun = False
        """Whether anything was written; from then on it need be told only of beats in which something happened."""

    def write(self, now: int, events: Sequence[Event]) -> None:
        """Take in what happened in a beat, at `now` nanoseconds."""
        came = [self._change_things(event) for event in events]
        switched = [self._switch(event) for event in events]
        if any(came) or not self.begun:
            self._out.publish(topics.THINGS, now, marker_array(self._shown_things()))
        if any(switched) or not self.begun:
            self._out.publish(topics.SCENE, now, marker_array(self._shown_scene()))
        self.begun = True

    def _change_things(self, event: Event) -> bool:
        if event.kind == EventKind.OBJECT_SPAWNED:
            self._things[event.name] = event
            return True
        return event.kind == EventKind.OBJECT_REMOVED and self._things.pop(event.name, None) is not None

    def _switch(self, event: Event) -> bool:
        if event.kind != EventKind.ZONE_SWITCHED:
            return False
        what: Filter = "speed" if event.data.get("filter") == "speed" else "keepout"
        known = self._known(what, event.name)
        limit = event.data.get("speed_limit", 0.0)
        if not event.data.get("enabled"):
            self._zones.pop((what, event.name), None)
        elif known is not None:
            self._zones[what, event.name] = replace(known, speed_limit=limit if isinstance(limit, float) else 0.0)
        return True

    def _known(self, what: Filter, region: str) -> FilterZone | None:
        """A zone as it was at the start, or one of a region that was none."""
        for zone in self._scenery.zones:
            if (zone.filter, zone.region, zone.robot) == (what, region, self._robot):
                return zone
        outline = self._case.regions.get(region)
        return FilterZone(what, region, outline) if outline else None

    def _shown_things(self) -> Iterator[Marker]:
        for name, event in self._things.items():
            group, color = "things", OBJECT_COLOR
            if event.data.get("person"):
                group, color = "people", PERSON_COLOR
            elif name in self._doors:
                group, color = "doors", DOOR_COLOR
            frame = frame_names.object_frame(name)
            if outlines := _outlines(event):
                yield Marker(
                    frame, group, LINE_LIST, color, LINE_SCALE, points=outline_edges(outlines, _MARKER_HEIGHT_M)
                )
            yield Marker(frame, "names", TEXT, color, TEXT_SCALE, _TEXT_POSE, text=name)

    def _shown_scene(self) -> Iterator[Marker]:
        for frame, group, color in (
            (self._names.truth, "footprint", TRUTH_COLOR),
            (self._names.base, "believed footprint", BELIEF_COLOR),
        ):
            if self._case.footprint:
                yield Marker(
                    frame,
                    group,
                    LINE_LIST,
                    color,
                    LINE_SCALE,
                    points=outline_edges([self._case.footprint], _MARKER_HEIGHT_M),
                )
        for zone in self._zones.values():
            yield from _zone_markers(zone)
        for ground in self._scenery.ground:
            outline = outline_edges([ground.outline], ground.height + _MARKER_HEIGHT_M)
            yield Marker(frame_names.MAP, "ramps", LINE_LIST, RAMP_COLOR, LINE_SCALE, points=outline)
        for name, place in self._scenery.places.items():
            yield Marker(frame_names.MAP, "places", ARROW, PLACE_COLOR, (0.4, 0.06, 0.06), Pose3.planar(place))
            yield Marker(
                frame_names.MAP, "places", TEXT, PLACE_COLOR, TEXT_SCALE, Pose3(place.x, place.y, 0.3), text=name
            )


def _outlines(event: Event) -> list[list[tuple[float, float]]]:
    """The parts that an object.spawned event tells; those that are no polygons, as plug-ins may tell, are left out."""
    parts = event.data.get("parts")
    read = [_corners(part) for part in parts] if isinstance(parts, list) else []
    return [corners for corners in read if len(corners) > 2]


def _corners(part: Value) -> list[tuple[float, float]]:
    found = []
    for corner in part if isinstance(part, list) else []:
        match corner:
            case [int() | float() as x, int() | float() as y]:
                found.append((float(x), float(y)))
    return found


def _zone_markers(zone: FilterZone) -> Iterator[Marker]:
    keepout = zone.filter == "keepout"
    group, color = f"{zone.filter} zones", KEEPOUT_COLOR if keepout else SPEED_COLOR
    told = zone.region if keepout or not zone.speed_limit else f"{zone.region}: {zone.speed_limit:g} m/s"
    if zone.outline:
        yield Marker(
            frame_names.MAP, group, LINE_LIST, color, LINE_SCALE, points=outline_edges([zone.outline], _MARKER_HEIGHT_M)
        )
        x, y = np.mean(zone.outline, axis=0).tolist()
        yield Marker(frame_names.MAP, group, TEXT, color, TEXT_SCALE, Pose3(x, y, 0.3), text=told)
    if zone.cells is not None:
        blocks = sorted(zone.cells.blocks, key=lambda block: -block[2] * block[3])[:MAX_MASK_BLOCKS]
        corners = np.array([(c, r, c + w, r + h) for c, r, w, h, _ in blocks], dtype=np.float64).reshape(-1, 4)
        points, pose = (
            rectangle_triangles(corners * zone.cells.resolution, _MARKER_HEIGHT_M),
            Pose3.planar(zone.cells.origin),
        )
        yield Marker(frame_names.MAP, group, TRIANGLE_LIST, (*color[:3], 0.35), (1.0, 1.0, 1.0), pose, points)
