"""Tests of chained events: each step waits for the previous step."""

import pytest

from simscen.core.geometry import Pose2
from simscen.core.records.events import EventKind
from simscen.run.live_world.director import RelativeSituation
from simscen.testing.fakes import FakeStage
from simscen.triggers.base import Trigger

PUSH = "do: {push: {impulse: [0, 0.001]}}"
CHAIN = f"""\
events:
  - name: story
    when: {{time: 1 s}}
    then:
      - {{when: {{time: 500 ms}}, {PUSH}}}
      - {{name: drives on, when: {{travelled: 30 cm}}}}
      - {{when: {{speed_above: 0.1 m/s, for: 400 ms, delay: 100 ms}}, {PUSH}}}
      - {{do: {{new_goal: {{name: back, pose: {{x: 1, y: 1}}}}}}}}
      - {{name: sent on, when: {{goal: {{status: accepted}}}}}}
      - {{name: home, when: {{goal: {{status: reached}}}}, {PUSH}, required: false}}
  - {{name: meanwhile, when: {{event: {{name: drives on}}}}, {PUSH}}}
faults: [{{sensor: lidar, dropout: {{probability: 1}}, when: {{event: {{name: story then 3}}}}, for: 1 s}}]
"""


@pytest.fixture(scope="module")
def trace(play):
    return play(CHAIN, goals="[{name: desk, pose: {x: 6.5, y: 1, yaw: 0}}]")


def ticks(trace, *kinds):
    return {event.name: event.tick for event in trace.of_kind(*(kinds or (EventKind.EVENT_STARTED,)))}


def test_each_step_counts_from_the_previous_one(trace):
    at = ticks(trace)
    assert at["story"] == 240
    assert at["story then 1"] == 360
    truth = {name: trace.truth.at([tick])[0] for name, tick in at.items()}
    distance = truth["drives on"][0] - truth["story then 1"][0]
    assert 0.3 <= distance < 0.33
    assert at["story then 3"] == at["drives on"] + 96 + 24  # the robot is already fast enough: 0.4 s and the delay
    assert at["story then 4"] == at["story then 3"]  # the step has no trigger


def test_step_ignores_events_before_its_start(trace):
    """The first goal was accepted long before; the step waits for the goal that the chain sends."""
    accepted = [event.tick for event in trace.of_kind(EventKind.GOAL_ACCEPTED) if event.name == "back"]
    at = ticks(trace)
    assert at["story then 4"] <= accepted[0] < at["sent on"] <= accepted[0] + 12
    (reached,) = (event.tick for event in trace.of_kind(EventKind.GOAL_REACHED) if event.name == "back")
    assert reached < at["home"] <= reached + 12


def test_events_and_faults_may_wait_for_a_step(trace):
    at = ticks(trace)
    assert at["drives on"] <= at["meanwhile"] <= at["drives on"] + 6
    assert ticks(trace, EventKind.FAULT_STARTED)["lidar.dropout"] == at["story then 3"]


def test_waiting_chain_does_not_change_the_run(play):
    plain = play("")
    chain = f"events: [{{when: {{time: 2 s}}, then: [{{when: {{travelled: 9 m}}, {PUSH}}}], required: false}}]\n"
    assert plain.truth.values.tolist() == play(chain).truth.values.tolist()


def test_conditions_of_a_step_count_from_its_start():
    stage = FakeStage(tick=1000, travelled=5.0, scans={"lidar": 990, "rear": 700})
    step = RelativeSituation(stage)

    def holds(trigger):
        return Trigger.model_validate(trigger).holds(step)

    assert not holds({"travelled": 1.0})
    assert not holds({"time": 1.0})
    assert holds({"scan_age": {"above": "1 s", "sensor": "rear"}})  # the age of a scan does not restart
    assert holds({"scan_age": {"above": "1 s", "sensor": "none yet"}})
    stage.tick, stage.travelled, stage.robot = 1240, 6.0, Pose2(5.0, 5.0)
    assert holds({"travelled": 1.0})
    assert holds({"time": 1.0})
    assert holds({"robot_within": {"of": [5, 5], "distance": 0}})  # uses the current pose
    assert not holds({"scan_age": {"above": "1.05 s", "sensor": "lidar"}})
    assert holds({"scan_age": {"above": "1 s", "sensor": "lidar"}})
