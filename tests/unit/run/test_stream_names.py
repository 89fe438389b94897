"""Tests that the random numbers of an event or fault do not depend on other events and faults."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.faults.base import FaultSetting
from simscen.model.disturbances import EventEntry, FaultEntry
from simscen.run.faults.command_link import CommandLink
from simscen.run.faults.injector import FaultInjector
from simscen.run.stream_names import stream_names

FAULTS = [
    "{sensor: lidar, noise: {std: 5 cm}%s}",
    "{sensor: lidar, beam_dropout: {probability: 30 %%}%s}",
    "{sensor: lidar, dropout: {probability: 30 %%}%s}",
    "{sensor: odom, bias: {linear_scale: 1.1}%s}",
    "{sensor: odom, slip: {left: 0.2, right: 0.1}%s}",
    "{sensor: lidar, off: {}%s, for: 0.5 s}",
    "{sensor: odom, dropout: {probability: 50 %%}%s}",
]
EVENTS = [
    "{%s, do: {push: {impulse: [0, 2]}}}",
    "{%s, do: {spawn: {name: extra, box: [0.3, 0.3, 0.3], ahead: [1, 0.3]}}}",
    "{%s, do: {kidnap: {pose: {x: 2, y: 3}}}}",
    "{%s, do: {cancel_goal: {}}}",
    "{%s, do: {new_goal: {name: elsewhere, pose: {x: 1, y: 4}}}}",
]
RANDOM = """\
events:
%s  - {name: a, when: {time: 0.2 s, probability: 0.5}, do: {push: {impulse: [0, 1]}}, required: false}
  - {name: b, when: {time: 0.3 s, probability: 0.5}, do: {push: {impulse: [0, 1]}}, required: false}
  - {name: c, when: {time: 0.4 s, probability: 0.5}, do: {push: {impulse: [0, 1]}}, required: false}
  - {name: d, when: {time: 0.5 s, probability: 0.5}, do: {push: {impulse: [0, 1]}}, required: false}
  - {name: e, when: {time: 0.6 s, probability: 0.5}, do: {push: {impulse: [0, 1]}}, required: false}
  - {name: f, when: {time: 0.7 s, probability: 0.5}, do: {push: {impulse: [0, 1]}}, required: false}
faults:
%s  - {sensor: lidar, noise: {std: 3 cm}}
  - {sensor: odom, dropout: {probability: 20 %%}, when: {time: 0.5 s}, for: 1 s}
  - {sensor: imu, dropout: {probability: 20 %%}}
"""
EFFECT_TICK = 240


def before(trace, end=EFFECT_TICK):
    """Return the samples, scans, and events before tick `end`.

    The index `entry` of an event in its list is left out because it changes with the number of entries.
    """
    samples = [trace.truth, trace.velocity, trace.clearance, trace.belief, trace.odometry, trace.command]
    events = [
        (event.tick, str(event.kind), event.name, {k: v for k, v in event.data.items() if k != "entry"})
        for event in trace.events
        if event.tick < end
    ]
    return [s.values[s.ticks < end].tolist() for s in samples], trace.scans[trace.scans < end].tolist(), events


@pytest.fixture(scope="module")
def plain(play):
    """The part of the run without a further event or fault."""
    return before(play(RANDOM % ("", "")))


@pytest.mark.sample(3)
@pytest.mark.parametrize("fault", FAULTS)
def test_adding_a_fault_changes_nothing_before_it_takes_effect(play, plain, fault):
    assert before(play(RANDOM % ("", "  - " + fault % ", when: {time: 1 s}" + "\n"))) == plain


@pytest.mark.parametrize("event", EVENTS)
def test_adding_an_event_changes_nothing_before_it_takes_effect(play, plain, event):
    assert before(play(RANDOM % ("  - " + event % "when: {time: 1 s}" + "\n", ""))) == plain


def make_injector(*faults):
    entries = [FaultEntry.model_validate(fault, by_alias=True, by_name=False) for fault in faults]
    kinds = {"lidar": FaultSetting(0.3, kind="Scan"), "odom": FaultSetting(0.3, kind="Odometry")}
    return FaultInjector(
        entries, Streams(7), lambda entry: kinds[entry.sensor], CommandLink(12, 120), lambda event: None
    )


def scan(tick=0):
    return Scan("lidar", tick, np.full(50, 2.0), -math.pi, 0.01, 0.1, 12.0)


def disturbed_ranges(injector, ticks=20):
    """Return the ranges of disturbed scans; None for a lost scan."""
    readings = [injector.disturb((scan(tick),)) for tick in range(ticks)]
    return [reading[0].ranges.tolist() if reading else None for reading in readings]


KINDS = [{"noise": {"std": 0.1}}, {"dropout": {"probability": 0.5}}, {"beam_dropout": {"probability": 0.5}}]
LATER = {"sensor": "lidar", "when": {"time": "5 s"}}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("other", KINDS)
@pytest.mark.parametrize("name", [None, "mine"])
def test_an_ended_fault_does_not_change_the_random_numbers_of_others(kind, other, name):
    tested_fault = {**LATER, **kind} | ({"name": name} if name else {})
    alone, with_other_fault = (
        make_injector(tested_fault),
        make_injector({"sensor": "lidar", "for": "1 s", **other}, tested_fault),
    )
    with_other_fault.begin(0)
    disturbed_ranges(with_other_fault)
    with_other_fault.end(0)
    alone.begin(0)
    with_other_fault.begin(1)
    np.testing.assert_equal(disturbed_ranges(alone), disturbed_ranges(with_other_fault))


@pytest.mark.parametrize("kind", KINDS)
def test_restarted_fault_has_new_random_numbers(kind):
    injector = make_injector({**LATER, **kind})
    drawn = []
    for _ in range(3):
        injector.begin(0)
        drawn.append(repr(disturbed_ranges(injector)))
        injector.end(0)
    assert len(set(drawn)) == 3


def odometry(k):
    return Odometry("odom", k, Pose2(0.01 * k, 0.0, 0.0), Twist(0.5, 0.0, 0.0))


DISTORTIONS = [{"bias": {"linear_scale": 1.5}}, {"slip": {"left": 0.3, "right": 0.2}}]


@pytest.mark.parametrize("first", DISTORTIONS)
@pytest.mark.parametrize("second", [None, *DISTORTIONS])
@pytest.mark.parametrize("order", [1, -1])
def test_the_error_of_odometry_stays_when_the_same_or_another_fault_starts(first, second, order):
    """The reported position does not jump, and the error that has built up is not corrected."""
    entries = [{"sensor": "odom", **kind} for kind in (first, second) if kind]
    faults = make_injector(*entries[::order])
    indices = list(range(len(entries)))[::order]
    xs = []
    for k in range(100):
        if k % 20 == 5:
            faults.begin(indices[k // 20 % len(indices)])
        if k % 20 == 15:
            faults.end(indices[k // 20 % len(indices)])
        (reading,) = faults.disturb((odometry(k),))
        xs.append(math.hypot(reading.pose.x, reading.pose.y))
    steps = np.diff(xs)
    assert steps.min() > 0
    assert steps.max() < 0.02
    assert faults.disturb((odometry(100),))[0].pose.distance(odometry(100).pose) > 0.1


def test_stream_names_depend_on_name_or_content_but_not_on_position():
    def names(*entries):
        events = [EventEntry.model_validate(entry, by_alias=True, by_name=False) for entry in entries]
        return stream_names(events)

    push = {"when": {"time": "1 s"}, "do": {"push": {"impulse": [0, 1]}}}
    pull = {"when": {"time": 1.0, "delay": 0}, "do": {"push": {"impulse": [0, -1]}}}
    named = {**push, "name": "wind"}
    assert len(set(names(push, pull, named, push))) == 4
    assert names(push, pull, named)[0] == names(pull, named, push)[2]
    assert names(named) == names({**pull, "name": "wind"})
    assert names(push, pull)[1:] == names({**pull, "when": {"time": "1000 ms"}})


def test_keys_of_plugins_are_part_of_the_stream_name(yardwork):
    slow, fast = ({"when": {"reversing": speed}, "do": {"turn_robot": {"by": 1.0}}} for speed in (0.1, 0.2))
    other = {**slow, "do": {"turn_robot": {"by": 2.0}}}
    names = stream_names([EventEntry.model_validate(entry) for entry in (slow, fast, other)])
    assert len({name.rpartition("#")[0] for name in names}) == 3
