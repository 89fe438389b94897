"""Tests of the effects of teleport, stop, push, doors, and marks, according to the log."""

import math

import numpy as np
import pytest

from simscen.core.records.events import EventKind
from simscen.loading.scenario import load_scenario
from simscen.record.log_reader import read_log
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: outer wall, points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}]
  objects:
    - {name: bin, box: [0.2, 0.2, 0.3], pose: {x: 5.5, y: 0.5}, mass: 4 kg}
    - {name: crate, box: [0.2, 0.2, 0.3], pose: {x: 5.5, y: 1.5}}
    - {name: cart, box: [0.4, 0.4, 0.3], pose: {x: 3, y: 3.5}, move: {through: [[7, 3.5]], speed: 1 m/s}}
  doors:
    - {name: hatch, points: [[7, 1], [7, 2]], closed: true}
    - {name: slider, points: [[3, 2.5], [4, 2.5]], closed: true, motion: slide, travel: 80 cm}
robot: {pose: {x: 1, y: 1}}
stack: {localizer: {type: ground_truth}}
goals: [{pose: {x: 2.5, y: 1}, timeout: 60 s}]
time_limit: 6 s
linger: 6
events:
  - {name: away, when: {time: 1 s}, do: {teleport: {name: crate, pose: {x: 6.5, y: 3, yaw: 45 deg}}}}
  - {name: pushed, when: {time: 1 s}, do: {push: {name: bin, force: [0, 60], for: 0.5 s}}}
  - {name: no mass, when: {time: 1 s}, do: {push: {name: crate, impulse: [0, 5]}}, required: false}
  - {name: waits, when: {time: 1 s}, do: {stop: {name: cart, for: 1 s}}}
  - {name: stops, when: {time: 3 s}, do: {stop: {name: cart}}}
  - {name: not moving, when: {time: 3.5 s}, do: {stop: {name: cart}}, required: false}
  - name: hatch opens
    when: {time: 1 s}
    do: {open: {name: hatch, duration: 2 s}}
    then:
      - {when: {time: 0.5 s}, do: {close: {name: hatch, duration: 2 s}}}
  - {name: slides, when: {time: 1 s}, do: [{open: {name: slider, to: 50 %}}, {mark: {name: now}}]}
  - {name: after the mark, when: {event: {name: now}, delay: 0.5 s}, do: {mark: {name: later}}}
pass:
  - stopped_within: {time: 4 s, after: later}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Return the finished run, and the trace that is read from its log."""
    folder = tmp_path_factory.mktemp("events")
    file, log = folder / "own.scenario.yaml", folder / "log.mcap"
    file.write_text(SCENARIO)
    return simulate(prepare(load_scenario(file, folder)), log=log), read_log(log).trace


def pose_at(trace, name, seconds):
    """Return the pose (x, y, yaw) of an object at a time in s."""
    samples = trace.objects[name]
    return samples.values[np.searchsorted(samples.ticks, round(seconds * trace.tick_rate))]


def test_all_events_happen_except_the_impossible_ones(run):
    finished_run, _ = run
    outcomes = {outcome.disturbance.name: outcome for outcome in finished_run.result.disturbances}
    assert {name for name, outcome in outcomes.items() if not outcome.happened} == {"no mass", "not moving"}
    assert outcomes["no mass"].effect == "crate has no mass or is moved by a script, so it cannot be pushed"
    assert outcomes["not moving"].effect == "cart was not moving"
    assert outcomes["hatch opens then 1"].effect == "hatch swings shut"


def test_teleported_object_is_at_its_new_pose(run):
    _, trace = run
    assert pose_at(trace, "crate", 1.0)[:2] == pytest.approx((6.5, 3.0)) or pose_at(trace, "crate", 1.0)[0] == 5.5
    assert pose_at(trace, "crate", 1.05) == pytest.approx((6.5, 3.0, math.pi / 4), abs=1e-6)
    (placement,) = [event for event in trace.of_kind(EventKind.OBJECT_PLACED) if event.name == "crate"]
    assert (placement.data["x"], placement.data["y"]) == (6.5, 3.0)


def test_paused_cart_continues_and_stopped_cart_stays(run):
    _, trace = run
    for seconds, x in ((0.5, 3.5), (1.5, 4.0), (2.5, 4.5), (3.5, 5.0), (5.0, 5.0)):
        assert pose_at(trace, "cart", seconds)[0] == pytest.approx(x, abs=0.01)


def test_a_pushed_bin_slides(run):
    _, trace = run
    assert pose_at(trace, "bin", 1.5)[1] > 0.6
    (push,) = trace.of_kind(EventKind.OBJECT_PUSHED)
    assert push.data == {"impulse": [0.0, 30.0], "seconds": 0.5}


def test_doors_reverse_and_slide(run):
    _, trace = run
    shut = math.pi / 2
    assert pose_at(trace, "hatch", 1.5)[2] == pytest.approx(shut + math.pi / 8, abs=0.02)
    assert pose_at(trace, "hatch", 1.75)[2] == pytest.approx(shut + math.pi / 16, abs=0.02)
    assert pose_at(trace, "hatch", 2.1)[2] == pytest.approx(shut, abs=1e-3)
    assert pose_at(trace, "slider", 1.7)[:2] == pytest.approx((3.0 - 0.3733, 2.5), abs=0.01)
    assert pose_at(trace, "slider", 2.0)[:2] == pytest.approx((2.6, 2.5), abs=1e-6)


def test_marks_are_logged_and_usable_in_triggers_and_criteria(run):
    finished_run, trace = run
    marks = {event.name: trace.seconds(event.tick) for event in trace.of_kind(EventKind.MARK)}
    assert marks == pytest.approx({"now": 1.0, "later": 1.5}, abs=0.05)
    verdicts = finished_run.result.verdicts
    assert [verdict.status.value for verdict in verdicts if verdict.criterion == "stopped_within"] == ["pass"]


def test_pedestrian_can_be_stopped_in_any_cycle(tmp_path):
    anna = "{pedestrian: {name: anna, pose: {x: 2, y: 3}, goals: [[6, 3]]}}"
    file = tmp_path / "own.scenario.yaml"
    for when in (1.0, 1.0125):
        file.write_text(f"""\
simscen: 1
world: {{simscen: 1, walls: [{{points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}}]}}
robot: {{pose: {{x: 1, y: 1}}}}
stack: {{localizer: {{type: ground_truth}}}}
goals: [{{pose: {{x: 3, y: 1}}}}]
time_limit: 2 s
events:
  - {{when: {{time: 0 s}}, do: {anna}}}
  - {{name: stops, when: {{time: {when} s}}, do: {{stop: {{name: anna}}}}}}
pass: [{{collisions: {{max: 5}}}}]
""")
        finished_run = simulate(prepare(load_scenario(file, tmp_path)))
        assert {outcome.disturbance.name: outcome.happened for outcome in finished_run.result.disturbances}["stops"]
        assert 2.3 < finished_run.trace.objects["anna"].values[-1][0] < 2.9, "the pedestrian did not stop"
