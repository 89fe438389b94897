"""Movable objects of a run: their outlines at a tick, and the events that spawned or moved them."""

from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.polygons import points_in_polygon
from simscen.core.records.event_shapes import spawn_pose, spawned_outlines
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace


@dataclass(frozen=True)
class MovableObject:
    """State of a movable object at a tick.

    outlines:     corners (n, 2) in m of each part of the object in the world frame
    event_name:   name of the event that spawned or last moved the object; "" if no event did
    change_tick:  tick at which the object was spawned or last moved (placed, pushed, or sent along a path)
    was_moved:    whether the object was moved after it was spawned
    """

    name: str
    outlines: tuple[Array, ...]
    event_name: str
    change_tick: int
    was_moved: bool

    def describe(self, trace: Trace) -> str:
        """Return the name and the last change, e.g. "crate (spawned by event `crate falls` at t = 1.00 s)"."""
        if not self.event_name:
            return self.name
        verb = "moved" if self.was_moved else "spawned"
        return f"{self.name} ({verb} by event `{self.event_name}` at t = {trace.seconds(self.change_tick):.2f} s)"

    def distance(self, points: Array) -> Array:
        """Return the distances in m (n,) from points (n, 2) to the object; 0 inside the object."""
        nearest: Array = np.min([_distance(points, outline) for outline in self.outlines], axis=0)
        return nearest


def movable_objects(trace: Trace, tick: int) -> list[MovableObject]:
    """Return the movable objects that exist at `tick`, in the order in which they were spawned."""
    spawned: dict[str, Event] = {}
    last_changes: dict[str, tuple[str, Event]] = {}
    current_event = ""
    for event in trace.events:
        if event.tick > tick:
            continue
        match event.kind:
            case EventKind.EVENT_STARTED:
                current_event = event.name
            case EventKind.EVENT_ENDED:
                current_event = ""
            case EventKind.OBJECT_SPAWNED:
                spawned[event.name], last_changes[event.name] = event, (current_event, event)
            case EventKind.OBJECT_MOVED | EventKind.OBJECT_PLACED | EventKind.OBJECT_PUSHED:
                last_changes[event.name] = (current_event, event)
            case EventKind.OBJECT_REMOVED:
                spawned.pop(event.name, None)
    return [
        _movable_object(trace, tick, event, *last_changes[name])
        for name, event in spawned.items()
        if spawned_outlines(event)
    ]


def _movable_object(trace: Trace, tick: int, spawned: Event, event_name: str, last_change: Event) -> MovableObject:
    """Return the state of an object at `tick`. The scenario event `event_name` caused the last change."""
    pose = spawn_pose(spawned)
    samples = trace.objects.get(spawned.name)
    if samples is not None:
        # The sample at the tick of the spawning precedes it, and can belong to an earlier object of the same name.
        is_valid = (samples.ticks > spawned.tick) & (samples.ticks <= tick)
        if is_valid.any():
            pose = Pose2(*samples.values[is_valid][-1].tolist())
    outlines = tuple(pose.apply(np.array(outline)) for outline in spawned_outlines(spawned))
    was_moved = last_change.kind != EventKind.OBJECT_SPAWNED
    return MovableObject(spawned.name, outlines, event_name, last_change.tick, was_moved)


def _distance(points: Array, corners: Array) -> Array:
    """Return the distances in m (n,) from points (n, 2) to a filled polygon (m, 2)."""
    edges, offsets = np.roll(corners, 1, axis=0) - corners, points[:, None] - corners
    projections, squared_lengths = np.sum(offsets * edges, axis=2), np.sum(edges**2, axis=1)
    shares = np.divide(projections, squared_lengths, out=np.zeros_like(projections), where=squared_lengths > 0)
    shares = np.clip(shares, 0.0, 1.0)
    edge_distances: Array = np.linalg.norm(offsets - shares[:, :, None] * edges, axis=2).min(axis=1)
    return np.where(points_in_polygon(corners.tolist(), points), 0.0, edge_distances)
