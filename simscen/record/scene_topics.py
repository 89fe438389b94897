"""What there is to see, as markers: /simscen/things, which move with their frames, and /simscen/scene, which stays."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from simscen.core.environment.costmap_filters import Filter
from simscen.core.environment.scenery import FilterZone, Scenery
from simscen.core.geometry import Pose3
from simscen.core.records.case import Case
from simscen.core.records.events import Event, EventKind, Value
from simscen.record import frames, topics
from simscen.record.frames import RobotFrames
from simscen.record.markers import ARROW, LINE_LIST, TEXT, TRIANGLE_LIST, Color, Marker, boxes, marker_array, rims
from simscen.record.out import Out

THING: Color = (0.0, 0.41, 0.58, 1.0)
PERSON: Color = (0.48, 0.24, 0.51, 1.0)
DOOR: Color = (0.59, 0.38, 0.0, 1.0)
KEEPOUT: Color = (0.76, 0.19, 0.06, 1.0)
SPEED: Color = (0.9, 0.62, 0.0, 1.0)
PLACE: Color = (0.44, 0.45, 0.49, 1.0)
RAMP: Color = (0.66, 0.58, 0.43, 1.0)
TRUTH: Color = (0.0, 0.44, 0.34, 1.0)
BELIEF: Color = (0.8, 0.2, 0.5, 1.0)
"""Okabe and Ito's hues, as on pages and pictures."""
LINE, LETTERS = (0.03, 0.0, 0.0), (0.0, 0.0, 0.25)
"""Scales: the width of a line and the height of letters in m."""
MOST_BLOCKS = 2000
"""Blocks of a filter mask that are drawn; the largest come first."""
_ABOVE = 0.02  # over the floor, so that the map does not hide it
_LETTERS_ABOVE = Pose3(0.0, 0.0, 0.5)


class SceneTopics:
    """Writes all that is there to be seen when anything of it has changed; where things are is told by /tf."""

    def __init__(self, out: Out, case: Case, scenery: Scenery, names: RobotFrames, robot: str) -> None:
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
            group, color = "things", THING
            if event.data.get("person"):
                group, color = "people", PERSON
            elif name in self._doors:
                group, color = "doors", DOOR
            frame = frames.of_object(name)
            if outlines := _outlines(event):
                yield Marker(frame, group, LINE_LIST, color, LINE, points=rims(outlines, _ABOVE))
            yield Marker(frame, "names", TEXT, color, LETTERS, _LETTERS_ABOVE, text=name)

    def _shown_scene(self) -> Iterator[Marker]:
        for frame, group, color in (
            (self._names.truth, "footprint", TRUTH),
            (self._names.base, "believed footprint", BELIEF),
        ):
            if self._case.footprint:
                yield Marker(frame, group, LINE_LIST, color, LINE, points=rims([self._case.footprint], _ABOVE))
        for zone in self._zones.values():
            yield from _zone(zone)
        for ground in self._scenery.ground:
            outline = rims([ground.outline], ground.height + _ABOVE)
            yield Marker(frames.MAP, "ramps", LINE_LIST, RAMP, LINE, points=outline)
        for name, place in self._scenery.places.items():
            yield Marker(frames.MAP, "places", ARROW, PLACE, (0.4, 0.06, 0.06), Pose3.planar(place))
            yield Marker(frames.MAP, "places", TEXT, PLACE, LETTERS, Pose3(place.x, place.y, 0.3), text=name)


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


def _zone(zone: FilterZone) -> Iterator[Marker]:
    keepout = zone.filter == "keepout"
    group, color = f"{zone.filter} zones", KEEPOUT if keepout else SPEED
    told = zone.region if keepout or not zone.speed_limit else f"{zone.region}: {zone.speed_limit:g} m/s"
    if zone.outline:
        yield Marker(frames.MAP, group, LINE_LIST, color, LINE, points=rims([zone.outline], _ABOVE))
        x, y = np.mean(zone.outline, axis=0).tolist()
        yield Marker(frames.MAP, group, TEXT, color, LETTERS, Pose3(x, y, 0.3), text=told)
    if zone.cells is not None:
        blocks = sorted(zone.cells.blocks, key=lambda block: -block[2] * block[3])[:MOST_BLOCKS]
        corners = np.array([(c, r, c + w, r + h) for c, r, w, h, _ in blocks], dtype=np.float64).reshape(-1, 4)
        points, pose = boxes(corners * zone.cells.resolution, _ABOVE), Pose3.planar(zone.cells.origin)
        yield Marker(frames.MAP, group, TRIANGLE_LIST, (*color[:3], 0.35), (1.0, 1.0, 1.0), pose, points)
