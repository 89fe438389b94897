"""Outlines of the objects on the picture of a run, from the world and from the events that spawned them."""

from collections.abc import Sequence

import numpy as np

from simscen.core.environment.scenery import MovableObject
from simscen.core.geometry import Array
from simscen.core.records.event_shapes import spawned_outlines
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace

Outlines = tuple[Array, ...]
"""Polygons (n, 2) in m in the frame of an object, one for each part of the object."""
_UNKNOWN_SHAPE: Outlines = (
    0.2 * np.column_stack((np.cos(np.arange(32) * np.pi / 16), np.sin(np.arange(32) * np.pi / 16))),
)
"""Circle with a radius of 0.2 m for an object whose shape is unknown."""


def object_outlines(trace: Trace, world_objects: Sequence[MovableObject]) -> dict[str, Outlines]:
    """Return the outlines of `world_objects` and of all spawned objects by name; a circle for an unknown shape."""
    outlines = {each.name: tuple(map(np.array, each.outlines)) for each in world_objects if each.outlines}
    outlines.update({event.name: outlines_of_event(event) for event in trace.of_kind(EventKind.OBJECT_SPAWNED)})
    for name in trace.objects:
        outlines.setdefault(name, _UNKNOWN_SHAPE)
    return outlines


def outlines_of_event(event: Event) -> Outlines:
    """Return the outlines in an object.spawned event; a circle if there are none."""
    return tuple(map(np.array, spawned_outlines(event))) or _UNKNOWN_SHAPE
