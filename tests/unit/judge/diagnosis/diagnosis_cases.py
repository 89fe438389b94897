"""Synthetic runs in which a robot does not reach the goal `study`, and the explanation of the failure."""

from simscen.judge.failure_causes import causes
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

GOAL = {"name": "study", "pose": [8, 0, 0]}
DOOR = ["study", [5, 0.5], [5, -0.5], "west wall", "east wall"]
CASE = {
    "goals": [GOAL],
    "passages": [DOOR],
    "inscribed_radius": 0.2,
    "footprint": [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2]],
}
STATIONARY = {"seconds": 10, "truth": [[0, 0, 0], [4, 4, 0], [10, 4, 0]]}
REFUSED = [[0, "goal.accepted", "study"], [10, "goal.failed", "study", {"error_name": "NO_VALID_PATH"}]]


def box(at, name, x, y, length, width, event=""):
    half, side = length / 2, width / 2
    corners = [[-half, -side], [half, -side], [half, side], [-half, side]]
    spawned = [at, "object.spawned", name, {"x": x, "y": y, "yaw": 0.0, "parts": [corners]}]
    return with_event(event, at, spawned) if event else [spawned]


def with_event(event, at, *effects):
    outcomes = [{"happened": True, "what": "something"}]
    started, ended = [at, "event.started", event, {"entry": 0}], [at, "event.ended", event, {"effects": outcomes}]
    return [started, *effects, ended]


def why(criterion, events, at=10, trace=STATIONARY, case=CASE, **changes):
    built = synthetic_trace({**trace, "events": [*REFUSED, *events], **changes})
    return causes(criterion, round(at * 240), built, synthetic_case(case))


def slip(start, effect, end=None, name="odom.slip", kind="slip", **details):
    events = [
        [start, "fault.started", name, {"entry": 0, "fault": kind, **details}],
        [effect, "fault.took_effect", name, {"entry": 0}],
    ]
    return [*events, *([[end, "fault.ended", name, {"entry": 0}]] if end else [])]
