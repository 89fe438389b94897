"""How what the robot touched came to be there."""

import numpy as np

from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.judge.diagnosis.objects import MovableObject, movable_objects

OBJECT_MOVING_SPEED_M_S = 0.0625
"""m/s from which a thing moves."""
OBJECT_SPEED_WINDOW_S = 0.25
"""Seconds over which its speed is taken."""


def diagnose_collision(trace: Trace, tick: int) -> tuple[list[str], set[str]]:
    """A sentence for each thing that can move and was touched at `tick`; and the events that brought it there."""
    hits = {hit.name: hit for hit in trace.of_kind(EventKind.COLLISION_STARTED) if hit.tick == tick}
    touched = [thing for thing in movable_objects(trace, tick) if thing.name in hits]
    told = [(thing, _told(trace, thing, hits[thing.name])) for thing in touched]
    return [text for _, text in told if text], {thing.event for thing, text in told if text}


def _told(trace: Trace, thing: MovableObject, hit: Event) -> str:
    ago = f"{trace.seconds(hit.tick - thing.since):.2f} s before"
    parts = []
    if thing.event:
        did = "moved it" if thing.moved else f"put it {_away(trace, thing):.2f} m from the robot's middle"
        parts.append(f"event `{thing.event}` had {did} {ago}")
    if (speed := _speed(trace, thing.name, hit.tick)) >= OBJECT_MOVING_SPEED_M_S:
        parts.append(f"it moved at {speed:.2f} m/s")
    if hit.data.get("robot_caused") is False and parts:
        parts.append("and ran into the robot")
    return f"{thing.name}: {', '.join(parts)}" if parts else ""


def _away(trace: Trace, thing: MovableObject) -> float:
    """How far from the robot's middle it was put; nothing has moved it since."""
    return float(thing.distance(np.array([trace.place(thing.since)]))[0])


def _speed(trace: Trace, name: str, tick: int) -> float:
    samples = trace.objects.get(name)
    if samples is None:
        return 0.0
    before = tick - round(OBJECT_SPEED_WINDOW_S * trace.tick_rate)
    (x0, y0), (x1, y1) = samples.at(np.array([before, tick]))[:, :2].tolist()
    return float(np.hypot(x1 - x0, y1 - y0)) / OBJECT_SPEED_WINDOW_S
