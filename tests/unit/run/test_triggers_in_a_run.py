"""Tests that the triggers of a run fire at the ticks that its trace implies."""

import numpy as np
import pytest

from simscen.core.records.events import EventKind

WAIT = "{name: %s, when: {%s}, do: {push: {impulse: [0, 0.001]}}, required: false}"
WHEN = {
    "turns": "turning_above: 0.5 rad/s",
    "stands": "speed_below: 2 cm/s, for: 1 s",
    "near": "clearance_below: 0.9 m",
    "blind": "scan_age: {above: 700 ms, sensor: lidar}",
    "lost": "localization_lost: {tolerance: 0.4 m}",
    "thinks": "believed_distance_remaining: 2.5 m",
    "is": "distance_remaining: 2.5 m",
    "after": "event: {name: lidar.off, status: ended}",
}
EVENTS = """\
events:
  - {name: kidnapped, when: {time: 3 s}, do: {kidnap: {pose: {x: 2.5, y: 2, yaw: 0.5}}}}
%s
faults: [{sensor: lidar, off: {}, when: {time: 5 s}, for: 1.5 s}]
"""


@pytest.fixture(scope="module")
def trace(play):
    waiting = "\n".join("  - " + WAIT % item for item in WHEN.items())
    return play(EVENTS % waiting, goals="[{name: desk, pose: {x: 6.5, y: 2, yaw: 2}}]")


def fired(trace, name):
    return [event.tick for event in trace.of_kind(EventKind.EVENT_STARTED) if event.name == name]


def first_true(ticks, values):
    """Return the ticks of the last false sample and of the first true sample."""
    k = int(np.argmax(values))
    assert values[k]
    assert not values[:k].any()
    return int(ticks[k - 1]) if k else -1, int(ticks[k])


def expected(trace, name):
    """Return the earliest and the latest tick at which the trigger must fire according to the trace."""
    truth, ticks = trace.truth.values, trace.truth.ticks
    speed = np.hypot(trace.velocity.values[:, 0], trace.velocity.values[:, 1])
    belief = trace.belief.at(ticks - 1)[:, :3]  # the belief before the beat
    goal = np.array([6.5, 2.0])
    match name:
        case "turns":
            return first_true(ticks, abs(trace.velocity.values[:, 2]) > 0.5)
        case "stands":
            still = speed < 0.02
            return first_true(
                ticks, np.array([still[max(0, k - 40) : k + 1].all() and k >= 40 for k in range(len(still))])
            )
        case "near":
            return first_true(ticks, trace.clearance.values[:, 0] < 0.9)
        case "blind":
            newest = np.array([max([0, *trace.scans[trace.scans < tick]]) for tick in ticks])
            return first_true(ticks, ticks - newest > 0.7 * trace.tick_rate)
        case "lost":
            return first_true(ticks, np.hypot(*(truth - belief)[:, :2].T) > 0.4)
        case "thinks":
            return first_true(ticks, np.hypot(*(belief[:, :2] - goal).T) <= 2.5)
        case "is":
            return first_true(ticks, np.hypot(*(truth[:, :2] - goal).T) <= 2.5)
        case "after":
            (end,) = trace.of_kind(EventKind.FAULT_ENDED)
            return end.tick, end.tick + 12


@pytest.mark.parametrize("name", WHEN)
def test_a_trigger_fires_when_the_trace_shows_its_condition(trace, name):
    (tick,) = fired(trace, name)
    earliest, latest = expected(trace, name)
    assert earliest <= tick <= latest  # a trigger that kidnapping causes fires at the same beat, after the sample


def test_clearance_search_radius_follows_the_trigger(play):
    events = (
        "events: [{name: far, when: {clearance_below: 2.9 m}, do: {push: {impulse: [0, 0.001]}}, required: false}]\n"
    )
    keys = {"robot": "{pose: {x: 4, y: 3}}", "goals": "[{pose: {x: 4, y: 3.2}}]"}
    room = "simscen: 1\nwalls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]\n"
    trace = play(events, room=room, **keys)
    distance = trace.clearance.values[:, 0]
    assert distance.max() > 2.1  # the default search radius is 2 m
    assert fired(trace, "far") == [int(trace.clearance.ticks[np.argmax(distance < 2.9)])]
