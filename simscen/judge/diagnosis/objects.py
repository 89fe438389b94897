"""Movable objects at a tick: their places, and the events that placed them."""

from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace


@dataclass(frozen=True)
class MovableObject:
    """Movable object at a tick.

    `outlines` (n, 2) are its outlines in the world. `since` is the tick at which the `event` (its name, or "") spawned
    the object or, if `moved`, last moved it.
    """

    name: str
    outlines: tuple[Array, ...]
    event: str
    since: int
    moved: bool

    def describe(self, trace: Trace) -> str:
        """Return name and origin, e.g. "crate (spawned by event `crate falls` at t = 1.00 s)"."""
        if not self.event:
            return self.name
        verb = "moved" if self.moved else "spawned"
        return f"{self.name} ({verb} by event `{self.event}` at t = {trace.seconds(self.since):.2f} s)"

    def distance(self, points: Array) -> Array:
        """Return the distances in m (n,) from points (n, 2) to the object; 0 inside."""
        nearest: Array = np.min([_distance(points, outline) for outline in self.outlines], axis=0)
        return nearest


def movable_objects(trace: Trace, tick: int) -> list[MovableObject]:
    """Return all movable objects at `tick`, in the order of their appearance."""
    spawned: dict[str, Event] = {}
    last: dict[str, tuple[str, Event]] = {}
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
                spawned[event.name], last[event.name] = event, (current_event, event)
            case EventKind.OBJECT_MOVED | EventKind.OBJECT_PLACED:
                last[event.name] = (current_event, event)
            case EventKind.OBJECT_REMOVED:
                spawned.pop(event.name, None)
    return [
        _movable_object(trace, tick, event, *last[name]) for name, event in spawned.items() if event.data.get("parts")
    ]


def pose_at(trace: Trace, spawned: Event, tick: int) -> Pose2:
    """Return the pose of a spawned object at `tick`."""
    x, y, yaw = (spawned.data.get(key) for key in ("x", "y", "yaw"))
    samples = trace.objects.get(spawned.name)
    if samples is not None:
        # The sample at its own tick precedes the spawning and may be that of an earlier object of the same name.
        now = (samples.ticks > spawned.tick) & (samples.ticks <= tick)
        if now.any():
            x, y, yaw = samples.values[now][-1].tolist()
    assert isinstance(x, int | float) and isinstance(y, int | float) and isinstance(yaw, int | float)
    return Pose2(float(x), float(y), float(yaw))


def _movable_object(trace: Trace, tick: int, spawned: Event, by: str, last: Event) -> MovableObject:
    pose, parts = pose_at(trace, spawned, tick), spawned.data["parts"]
    assert isinstance(parts, list)
    outlines = tuple(pose.apply(np.array(part, dtype=np.float64)) for part in parts)
    return MovableObject(spawned.name, outlines, by, last.tick, last.kind != EventKind.OBJECT_SPAWNED)


def _distance(points: Array, corners: Array) -> Array:
    """Return the distances in m (n,) from points (n, 2) to a filled polygon (m, 2)."""
    ends = np.roll(corners, 1, axis=0)
    step, apart = ends - corners, points[:, None] - corners
    along, squared = np.sum(apart * step, axis=2), np.sum(step**2, axis=1)
    along = np.clip(np.divide(along, squared, out=np.zeros_like(along), where=squared > 0), 0.0, 1.0)
    away: Array = np.linalg.norm(apart - along[:, :, None] * step, axis=2).min(axis=1)
    y0, y1 = corners[:, 1], ends[:, 1]
    crosses = (y0 > points[:, 1:]) != (y1 > points[:, 1:])
    x = corners[:, 0] + (points[:, 1:] - y0) / np.where(y1 == y0, 1.0, y1 - y0) * step[:, 0]
    inside = np.sum(crosses & (points[:, :1] < x), axis=1) % 2 == 1
    return np.where(inside, 0.0, away)
