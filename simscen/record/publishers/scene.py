"""Publisher of markers for 3D viewers: objects, footprints, zones, ramps, and places."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from simscen.core.environment.costmap_filters import Filter
from simscen.core.environment.scenery import FilterZone, Scenery
from simscen.core.geometry import Pose3
from simscen.core.records.case import Case
from simscen.core.records.event_shapes import spawned_outlines
from simscen.core.records.events import Event, EventKind
from simscen.record import frame_names, topics
from simscen.record.frame_names import RobotFrames
from simscen.record.messages.encode_markers import (
    ARROW,
    LINE_LIST,
    TEXT,
    TRIANGLE_LIST,
    Color,
    Marker,
    marker_array,
    outline_edges,
    rectangle_triangles,
)
from simscen.record.publishers.message_sinks import MessageSink

OBJECT_COLOR: Color = (0.0, 0.41, 0.58, 1.0)
PEDESTRIAN_COLOR: Color = (0.48, 0.24, 0.51, 1.0)
DOOR_COLOR: Color = (0.59, 0.38, 0.0, 1.0)
KEEPOUT_COLOR: Color = (0.76, 0.19, 0.06, 1.0)
SPEED_COLOR: Color = (0.9, 0.62, 0.0, 1.0)
PLACE_COLOR: Color = (0.44, 0.45, 0.49, 1.0)
RAMP_COLOR: Color = (0.66, 0.58, 0.43, 1.0)
TRUTH_COLOR: Color = (0.0, 0.44, 0.34, 1.0)
BELIEF_COLOR: Color = (0.8, 0.2, 0.5, 1.0)
"""Colors of Okabe and Ito, as in reports and pictures."""
LINE_SCALE, TEXT_SCALE = (0.03, 0.0, 0.0), (0.0, 0.0, 0.25)
"""`scale` of markers in m: x is the width of lines, z is the height of letters."""
MAX_MASK_BLOCKS = 2000
"""Maximum number of rectangles of a filter mask. The largest rectangles are drawn."""
_MARKER_HEIGHT_M = 0.02  # above the floor, so that the map does not hide markers
_TEXT_POSE = Pose3(0.0, 0.0, 0.5)


class ScenePublisher:
    """Publishes the markers of the world and of `robot` ("" for a single robot) when the markers change.

    A marker moves with its frame on /tf, without a new message.
    """

    def __init__(self, out: MessageSink, case: Case, scenery: Scenery, frames: RobotFrames, robot: str) -> None:
        self._out, self._case, self._frames, self._robot, self._scenery = out, case, frames, robot, scenery
        self._doors = {thing.name for thing in scenery.things if thing.closed is not None}
        self._spawned: dict[str, Event] = {}
        robot_zones = (zone for zone in scenery.zones if zone.robot == robot)
        self._zones: dict[tuple[str, str], FilterZone] = {(zone.filter, zone.region): zone for zone in robot_zones}
        self.has_published = False
        """True after the first call of `write`. Further calls of `write` are needed only at ticks with events."""

    def write(self, now: int, events: Sequence[Event]) -> None:
        """Update the markers after events, and publish them if they have changed. `now` is simulated time in ns."""
        objects_changed = [self._update_objects(event) for event in events]
        zones_changed = [self._update_zones(event) for event in events]
        if any(objects_changed) or not self.has_published:
            self._out.publish(topics.OBJECT_MARKERS, now, marker_array(self._object_markers()))
        if any(zones_changed) or not self.has_published:
            self._out.publish(topics.SCENE_MARKERS, now, marker_array(self._scene_markers()))
        self.has_published = True

    def _update_objects(self, event: Event) -> bool:
        """Apply an event to the moving objects. Return whether their markers have changed."""
        if event.kind == EventKind.OBJECT_SPAWNED:
            self._spawned[event.name] = event
            return True
        return event.kind == EventKind.OBJECT_REMOVED and self._spawned.pop(event.name, None) is not None

    def _update_zones(self, event: Event) -> bool:
        """Apply an event to the zones. Return whether their markers have changed."""
        if event.kind != EventKind.ZONE_SWITCHED:
            return False
        filter_: Filter = "speed" if event.data.get("filter") == "speed" else "keepout"
        zone = self._find_zone(filter_, event.name)
        limit = event.data.get("speed_limit", 0.0)
        if not event.data.get("enabled"):
            self._zones.pop((filter_, event.name), None)
        elif zone is not None:
            self._zones[filter_, event.name] = replace(zone, speed_limit=limit if isinstance(limit, float) else 0.0)
        return True

    def _find_zone(self, filter_: Filter, region: str) -> FilterZone | None:
        """Return the zone that a region has at the start of the run, or else a new zone; None for an unknown region."""
        for zone in self._scenery.zones:
            if (zone.filter, zone.region, zone.robot) == (filter_, region, self._robot):
                return zone
        outline = self._case.regions.get(region)
        return FilterZone(filter_, region, outline) if outline else None

    def _object_markers(self) -> Iterator[Marker]:
        for name, event in self._spawned.items():
            group, color = "things", OBJECT_COLOR
            if event.data.get("person"):
                group, color = "people", PEDESTRIAN_COLOR
            elif name in self._doors:
                group, color = "doors", DOOR_COLOR
            frame = frame_names.object_frame(name)
            if outlines := spawned_outlines(event):
                edges = outline_edges(outlines, _MARKER_HEIGHT_M)
                yield Marker(frame, group, LINE_LIST, color, LINE_SCALE, points=edges)
            yield Marker(frame, "names", TEXT, color, TEXT_SCALE, _TEXT_POSE, text=name)

    def _scene_markers(self) -> Iterator[Marker]:
        if self._case.footprint:
            edges, frames = outline_edges([self._case.footprint], _MARKER_HEIGHT_M), self._frames
            yield Marker(frames.truth, "footprint", LINE_LIST, TRUTH_COLOR, LINE_SCALE, points=edges)
            yield Marker(frames.base, "believed footprint", LINE_LIST, BELIEF_COLOR, LINE_SCALE, points=edges)
        for zone in self._zones.values():
            yield from _zone_markers(zone)
        for ground in self._scenery.ground:
            edges = outline_edges([ground.outline], ground.height + _MARKER_HEIGHT_M)
            yield Marker(frame_names.MAP, "ramps", LINE_LIST, RAMP_COLOR, LINE_SCALE, points=edges)
        for name, place in self._scenery.places.items():
            yield Marker(frame_names.MAP, "places", ARROW, PLACE_COLOR, (0.4, 0.06, 0.06), Pose3.planar(place))
            above = Pose3(place.x, place.y, 0.3)
            yield Marker(frame_names.MAP, "places", TEXT, PLACE_COLOR, TEXT_SCALE, above, text=name)


def _zone_markers(zone: FilterZone) -> Iterator[Marker]:
    is_keepout = zone.filter == "keepout"
    group, color = f"{zone.filter} zones", KEEPOUT_COLOR if is_keepout else SPEED_COLOR
    text = zone.region if is_keepout or not zone.speed_limit else f"{zone.region}: {zone.speed_limit:g} m/s"
    if zone.outline:
        edges = outline_edges([zone.outline], _MARKER_HEIGHT_M)
        yield Marker(frame_names.MAP, group, LINE_LIST, color, LINE_SCALE, points=edges)
        x, y = np.mean(zone.outline, axis=0).tolist()
        yield Marker(frame_names.MAP, group, TEXT, color, TEXT_SCALE, Pose3(x, y, 0.3), text=text)
    if zone.cells is not None:
        blocks = sorted(zone.cells.blocks, key=lambda block: -block[2] * block[3])[:MAX_MASK_BLOCKS]
        bounds = np.array([(c, r, c + w, r + h) for c, r, w, h, _ in blocks], dtype=np.float64).reshape(-1, 4)
        points = rectangle_triangles(bounds * zone.cells.resolution, _MARKER_HEIGHT_M)
        pose = Pose3.planar(zone.cells.origin)
        yield Marker(frame_names.MAP, group, TRIANGLE_LIST, (*color[:3], 0.35), (1.0, 1.0, 1.0), pose, points)
