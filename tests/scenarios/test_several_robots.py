"""Tests of runs with several robots: independence, result, log, and picture."""

import hashlib
import json

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from simscen.core.records.events import EventKind
from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import Status
from simscen.judge.result_json import from_json, to_json
from simscen.judge.run_result import judge_run
from simscen.judge.several_robots import combine_robots
from simscen.loading.scenario import load_scenario
from simscen.loading.scenario_text import criteria_of_text
from simscen.record.log_reader import read_log
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

WORLD = """\
simscen: 1
time_limit: 20 s
world:
  simscen: 1
  walls: [{name: wall, points: [[0, 0], [30, 0], [30, 6], [0, 6], [0, 0]]}]
"""
EAST = "pose: {x: 1, y: 3}, goals: [{name: east, pose: {x: 3, y: 3.4}}]"
FAR = "pose: {x: 28, y: 3}, goals: [{name: north, pose: {x: 28, y: 4}}]"
ONCOMING = "pose: {x: 2.2, y: 3, yaw: 180 deg}, stack: {collision_monitor: {enabled: false}}"
PASS = "pass: [{goals_reached: {}}, {collisions: {max: 0}}]\n"


@pytest.fixture
def run(tmp_path):
    """Return a function that simulates a scenario in WORLD, with a log."""

    def run(text, name="several"):
        file = tmp_path / f"{name}.scenario.yaml"
        file.write_text(WORLD + text)
        return simulate(prepare(load_scenario(file, tmp_path)), log=tmp_path / f"{name}.mcap")

    return run


def hash_of_messages(log, robot, seconds):
    """Return a hash of a robot's first messages, except the poses of the other robots."""
    digest, is_empty = hashlib.sha256(), True
    with log.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(end_time=int(seconds * 1e9)):
            if channel.topic.startswith(f"/{robot}/") and b"object" not in message.data:
                is_empty = False
                digest.update(f"{channel.topic} {message.log_time} ".encode() + message.data)
    assert not is_empty, f"the log has no messages of robot {robot}"
    return digest.hexdigest()


@pytest.mark.parametrize(
    "order", ["{new_goal: {name: sent, pose: {x: 2, y: 3}}, robot: a}", "{cancel_goal: {}, robot: a}"]
)
def test_command_from_an_event_takes_effect_in_the_robots_next_cycle(run, order):
    finished_run = run(
        f"robots: {{a: {{{EAST}}}, b: {{{FAR}, model: jackal}}}}\n"
        f"events: [{{when: {{time: 330 ms}}, do: {order}}}]\npass: [{{collisions: {{max: 0}}}}]\n"
    )
    canceled = next(event for event in finished_run.robots["a"].trace.events if event.kind is EventKind.GOAL_CANCELED)
    began = next(event for event in finished_run.robots["a"].trace.events if event.kind is EventKind.EVENT_STARTED)
    assert (began.tick, canceled.tick) == (80, 84)


def test_robots_that_never_meet_have_the_logs_of_single_runs(run):
    two = run(f"robots: {{b: {{{FAR}}}, a: {{{EAST}}}}}\n{PASS}", "two")
    three = run(
        f"robots: {{a: {{{EAST}}}, b: {{{FAR}, model: jackal}}, c: {{pose: {{x: 25, y: 1}}}}}}\n"
        "pass: [{collisions: {max: 0}}]\n",
        "three",
    )
    assert two.passed
    assert hash_of_messages(two.log, "a", 5) == hash_of_messages(three.log, "a", 5)


def test_verdicts_metrics_and_faults_are_per_robot_and_events_per_world(run):
    finished_run = run(
        f"robots: {{a: {{{EAST}, faults: [{{sensor: lidar, off: {{}}, for: 1 s}}], pass: [{{replans: {{max: 50}}}}]}},"
        f" b: {{{FAR}}}}}\n"
        "events: [{name: crate, when: {travelled: 0.5 m, robot: a}, "
        "do: {spawn: {name: crate, box: [0.3, 0.3, 0.3], pose: {x: 20, y: 1}}}}]\n" + PASS
    )
    result = finished_run.result
    assert [verdict.id for verdict in result.verdicts] == [
        "a/goals_reached", "a/collisions", "a/replans", "b/goals_reached", "b/collisions"
    ]  # fmt: skip
    assert result.outcome is Outcome.PASSED
    assert [outcome.disturbance.name for outcome in result.disturbances] == ["crate", "a/lidar.off"]
    assert result.metrics["a/path_length"] > 1.5 > result.metrics["b/path_length"]
    assert result.metrics["success"] == 1.0
    assert result.events["object.spawned"] == 1
    assert result.events["goal.reached"] == 2
    for robot in finished_run.robots.values():
        assert {event.name for event in robot.trace.of_kind(EventKind.EVENT_STARTED)} == {"crate"}
    assert not finished_run.robots["b"].trace.of_kind(EventKind.FAULT_STARTED)
    assert from_json(to_json(result)) == result


def test_log_contains_the_trace_of_each_robot(run):
    finished_run = run(f"robots: {{a: {{{EAST}}}, b: {{{ONCOMING}}}}}\n{PASS.replace('{goals_reached: {}}, ', '')}")
    log = read_log(finished_run.log)
    assert list(log.robots) == ["a", "b"]
    for name, robot_log in log.robots.items():
        assert robot_log.header.case == finished_run.robots[name].case
        assert robot_log.trace.truth.values.tobytes() == finished_run.robots[name].trace.truth.values.tobytes()
        assert robot_log.trace.events == finished_run.robots[name].trace.events
    results = {}
    for name, robot_log in log.robots.items():
        header = robot_log.header
        criteria = criteria_of_text(header.scenario, "log", header.facts, name).pass_
        results[name] = judge_run(header.key, "log", criteria, robot_log.trace, header.case)
    combined = combine_robots(results, {name: robot_log.trace for name, robot_log in log.robots.items()})
    assert [(v.id, v.findings) for v in combined.verdicts] == [(v.id, v.findings) for v in finished_run.result.verdicts]
    assert json.loads(log.result)["verdicts"]


def test_ros_tools_read_the_log_in_robot_namespaces(run):
    finished_run = run(f"robots: {{a: {{{EAST}}}, b: {{{FAR}}}}}\n{PASS}")
    with AnyReader([finished_run.log], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        topics = {connection.topic: connection.msgtype for connection in bag.connections}
        assert {topic for topic in topics if not topic.startswith(("/a/", "/b/"))} == {"/clock"}
        assert {topic[2:] for topic in topics if topic.startswith("/a/")} >= {
            "/scan", "/odom", "/tf", "/tf_static", "/map", "/amcl_pose", "/plan", "/cmd_vel", "/ground_truth/odom"
        }  # fmt: skip
        assert topics["/a/scan"] == topics["/b/scan"] == "sensor_msgs/msg/LaserScan"
        frames = set()
        for connection, _, data in bag.messages([c for c in bag.connections if c.topic == "/a/tf"]):
            frames |= {link.child_frame_id for link in bag.deserialize(data, connection.msgtype).transforms}
        assert frames == {"a/base_link", "a/odom", "a/base_link_truth", "object/b"}
        times = [time for _, time, _ in bag.messages([c for c in bag.connections if c.topic == "/clock"])]
        assert len(times) == len(set(times)), "one clock for all"


def test_failing_robot_fails_the_run_with_its_name(run):
    finished_run = run(f"robots: {{a: {{{EAST}, pass: [{{path_length: {{max: 0.1 m}}}}]}}, b: {{{FAR}}}}}\n{PASS}")
    assert finished_run.result.outcome is Outcome.FAILED
    assert [v.id for v in finished_run.result.verdicts if v.status is Status.FAIL] == ["a/path_length"]
    assert finished_run.robots["b"].passed


def test_run_ends_when_all_robots_with_goals_have_ended(run):
    near = FAR.replace("y: 4", "y: 3.3")
    finished_run = run(
        f"robots: {{a: {{{EAST}}}, b: {{{near}}}, c: {{pose: {{x: 20, y: 3}}}}}}\npass: [{{collisions: {{}}}}]\n"
    )
    ended = [robot.trace.of_kind(EventKind.NAVIGATION_ENDED) for robot in finished_run.robots.values()]
    assert [len(events) for events in ended] == [1, 1, 0]
    assert finished_run.result.ended == "navigation ended"
    last = max(events[0].tick for events in ended if events)
    assert {robot.trace.end for robot in finished_run.robots.values()} == {last + 120}


def test_missing_event_is_reported_once(run):
    finished_run = run(
        f"robots: {{a: {{{EAST}}}, b: {{{FAR}}}}}\n"
        "events: [{name: crash, when: {robot_within: {object: b, distance: 1 m}, robot: a}, "
        "do: {push: {impulse: [1, 0]}, robot: b}}]\n" + PASS
    )
    assert [v.id for v in finished_run.result.verdicts if v.status is Status.FAIL] == ["crash"]


def test_effect_of_an_action_names_the_robot(run):
    finished_run = run(
        f"robots: {{a: {{{EAST}}}, b: {{{FAR}}}}}\n"
        "events: [{when: {time: 0.5 s}, do: {push: {impulse: [1, 0]}, robot: b}}]\n" + PASS
    )
    assert [outcome.effect for outcome in finished_run.result.disturbances] == ["b: pushed the robot with 1.0 N s"]
    pushed = [len(robot.trace.of_kind(EventKind.ROBOT_PUSHED)) for robot in finished_run.robots.values()]
    assert pushed == [0, 1]


def test_missing_fault_is_reported_with_its_robot(run):
    fault = "{sensor: lidar, off: {}, when: {travelled: 8 m}}"
    finished_run = run(f"robots: {{a: {{{EAST}, faults: [{fault}]}}, b: {{{FAR}}}}}\n{PASS}")
    (verdict,) = [each for each in finished_run.result.verdicts if each.status is Status.FAIL]
    assert verdict.id == "a/lidar.off"
    assert verdict.findings[0].measured == "a/lidar.off (when travelled: 8 m)"
