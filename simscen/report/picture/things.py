"""Doors, objects and people: where they ended, how they came there, and what is gone."""

from collections.abc import Iterator

import numpy as np

from simscen.core.environment.scenery import MovableObject
from simscen.core.geometry import Array, Pose2
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Samples
from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, shown
from simscen.report.picture.labels import Label
from simscen.report.picture.outline import Outlines, outlines, pose_of
from simscen.report.picture.scene import Scene
from simscen.report.picture.ways import stretches

_GHOSTS = 6
_STILL = 0.02
"""m and rad that something moves before it has a way."""


def draw_things(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Each where it ended, with its way and ghosts on it in the color of their time.

    A ghost has the color that the robot's way has where the robot was at that moment. What is gone is an empty rim.
    """
    trace = scene.trace
    shapes = outlines(trace, scene.scenery.things)
    spawned = {event.name: event for event in trace.of_kind(EventKind.OBJECT_SPAWNED)}
    removed = {event.name: event.tick for event in trace.of_kind(EventKind.OBJECT_REMOVED)}
    doors = {thing.name: thing for thing in scene.scenery.things if thing.closed and thing.opened}
    for name in sorted(set(shapes) - set(scene.robots)):
        samples, event = trace.objects.get(name), spawned.get(name)
        person = event is not None and event.data.get("person") is True
        kind = "person" if person else "door" if name in doors else "object"
        color = palette.PERSON if person else palette.OBJECT
        if samples is not None:
            _way(canvas, scene, samples, shapes[name])
        if name in doors:
            _ends(canvas, doors[name], shapes[name])
        if samples is not None and len(samples):
            last = _pose(samples, -1)
        elif event is not None:
            last = pose_of(event)
        else:
            continue
        gone = removed.get(name, -1) >= (event.tick if event else 0)
        placed = [last.apply(outline) for outline in shapes[name]]
        for outline in placed:
            canvas.polygon(outline, None if gone else (*color, 150), color, 1.0 if gone else 1.5, busy=not gone)
            canvas.tell(f"{kind} {name}{' gone' if gone else ''}", outline)
        if person:
            _nose(canvas, last, placed[0])
        corners = np.concatenate(placed)
        x, y = ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
        told = f"{name} (gone at {trace.seconds(removed[name]):.1f} s)" if gone else name
        rim = float(np.ptp(corners, axis=0).min()) * canvas.scale / 2 + 2
        yield Label(4, x, y, shown(told), color, 12, min(rim, 40.0))


def _way(canvas: Canvas, scene: Scene, samples: Samples, shape: Outlines) -> None:
    """The way of a thing, dotted, and its ghosts; nothing of one that stood still."""
    for stretch in stretches(samples, scene.trace.tick_rate):
        if np.ptp(stretch.values[:, :2], axis=0).max() > _STILL:
            canvas.dashes(stretch.values[:, :2], palette.PLACE, 1.0, 2.5)
    for k in _ghosts(samples):
        color = palette.ramp(int(samples.ticks[k]) / max(scene.trace.end, 1))
        for outline in shape:
            canvas.polygon(_pose(samples, k).apply(outline), (*color, 30), color, 0.8)


def _ends(canvas: Canvas, door: MovableObject, shape: Outlines) -> None:
    """Where the panel of a door can be, and its hinge."""
    for end in (door.closed, door.opened):
        for corners in () if end is None else map(end.apply, shape):
            canvas.dashes(np.vstack((corners, corners[:1])), palette.OBJECT, 0.8, 3.0)
    if door.closed is not None:
        canvas.disc(door.closed.x, door.closed.y, 2.6, palette.OBJECT)


def _nose(canvas: Canvas, pose: Pose2, outline: Array) -> None:
    """Where somebody looks."""
    reach = float(np.hypot(*(outline - (pose.x, pose.y)).T).max())
    canvas.line(pose.apply(np.array([(0.0, 0.0), (1.5 * reach, 0.0)])), palette.PERSON, 2.0)


def _ghosts(samples: Samples) -> list[int]:
    """Samples evenly spread over the way of a thing, without the last; none of a thing that stood still."""
    steps = np.diff(samples.values[:, :3], axis=0)
    moved = np.hypot(steps[:, 0], steps[:, 1]) + 0.3 * np.abs(np.angle(np.exp(1j * steps[:, 2])))
    way = np.concatenate(([0.0], np.cumsum(moved)))
    if way[-1] < _STILL:
        return []
    chosen = np.searchsorted(way, np.linspace(0, way[-1], _GHOSTS)[:-1], side="right") - 1
    return sorted(set(chosen.tolist()))


def _pose(samples: Samples, k: int) -> Pose2:
    return Pose2(*samples.values[k, :3].tolist())
