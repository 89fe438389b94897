"""A navigation node without any knowledge of simscen drives scenarios over a real ROS 2."""

import hashlib
import json
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from simscen.record.log_reader import read_run

ROOT = Path(__file__).parents[2]
NODES = Path(__file__).with_name("nodes")
SCENARIOS = [
    pytest.param("navigation/goal", marks=pytest.mark.slow),
    pytest.param("navigation/patrol", marks=pytest.mark.slow),
    pytest.param("obstacles/pallet_on_plan", marks=pytest.mark.slow),
]


def slow_value(value: str) -> object:
    """A parameter value that only `make test-ros` runs."""
    return pytest.param(value, marks=pytest.mark.slow)


def digest(log: Path) -> str:
    return hashlib.sha256(log.read_bytes()).hexdigest()


@pytest.mark.parametrize("stamped", [pytest.param(False, marks=pytest.mark.slow), True], ids=["Twist", "TwistStamped"])
def test_a_goal_is_reached_by_goal_pose_in_a_namespace_with_remappings(ros, run, stamped: bool) -> None:
    names = ["-r", "__ns:=/robot1", "-r", "/tf:=tf", "-r", "/tf_static:=tf_static", "-r", "scan:=/front/scan"]
    words = ["--namespace", "robot1", "--remap", "/scan:=/front/scan"]
    ended = run(*words, "--launch", ros.node("navigator", *names, stamped=stamped))
    assert ended.code == 0, ended.output


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_navigator_passes_a_scenario_of_the_library(ros, run, name: str) -> None:
    ended = run("--launch", ros.node("navigator"), scenario=ROOT / "scenarios" / f"{name}.scenario.yaml")
    assert ended.code == 0, ended.output


@pytest.mark.slow
@pytest.mark.parametrize(
    "action",
    [
        "navigate_to_pose",
        *map(slow_value, ("navigate_through_poses", "follow_waypoints")),
    ],
)
def test_goals_are_sent_to_an_action_of_nav2(with_interfaces, run, tmp_path: Path, action: str) -> None:
    file = tmp_path / "short.scenario.yaml"
    file.write_text(
        file.read_text().replace("goals: [", "goals: [{name: first, pose: {x: 1.8, y: 1}, timeout: 30 s}, ")
    )
    launch = with_interfaces.node("navigator", action=action)
    ended = run("--goals", action, "--launch", launch, scenario="short.scenario.yaml")
    assert ended.code == 0, ended.output
    text = [event.kind.value for event in read_run(ended.logs[0]).trace.events if event.kind.value.startswith("goal.")]
    assert text == ["goal.accepted", "goal.reached"] * 2


WAY = "goals: [{name: way, pose: {x: 1.8, y: 1}%s}, {name: end, pose: {x: 2.4, y: 1}}]"
TOURS = {"navigate_through_poses": WAY % "", "follow_waypoints": WAY % ", on_reached: {wait: 1 s}"}


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["navigate_through_poses", "follow_waypoints"])
def test_the_scenario_selects_the_action(with_interfaces, run, tmp_path: Path, mode: str) -> None:
    head = "simscen: 1\nworld: room.world.yaml\nrobot: {pose: start}\ntime_limit: 90\n"
    tour = f"navigation: {{mode: {mode}, loops: 2}}\n{TOURS[mode]}\npass: [{{goals_reached: {{}}}}]\n"
    (tmp_path / "tour.scenario.yaml").write_text(head + tour)
    launch = with_interfaces.node("navigator", action=mode)
    ended = run("--launch", launch, scenario="tour.scenario.yaml")
    assert ended.code == 0, ended.output
    assert ended.about["goals"] == f"/{mode}"
    events = [event for event in read_run(ended.logs[0]).trace.events if event.kind.value.startswith("goal.")]
    way = "passed" if mode == "navigate_through_poses" else "reached"
    text = [(event.kind.value, event.name) for event in events if event.kind.value != "goal.accepted"]
    assert text == [
        (f"goal.{kind}", name + loop) for loop in ("", "#2") for kind, name in ((way, "way"), ("reached", "end"))
    ]


@pytest.mark.slow
@pytest.mark.parametrize("repeats", [2, 20])
def test_concurrent_lockstep_runs_have_equal_logs(ros, run, repeats: int) -> None:
    """Two parallel runs must not receive each other's messages."""
    with ThreadPoolExecutor(2) as pool:
        words = ["--settle", "0.2", "--launch", ros.node("navigator")]
        calls = [pool.submit(run, *words, scenario="short.scenario.yaml") for _ in range(repeats)]
        ended = [call.result() for call in calls]
    assert [one.code for one in ended] == [0] * repeats, ended[0].output
    assert len({digest(one.logs[0]) for one in ended}) == 1
    text = [one.about for one in ended]
    assert all(one["sync"] == "lockstep" and one["late_commands"] == 0 for one in text)
    assert text == [text[0]] * repeats


@pytest.mark.slow
def test_paced_runs_are_marked(ros, run) -> None:
    words = ["--sync", "paced", "--factor", "4", "--launch", ros.node("navigator")]
    ended = run(*words, scenario="short.scenario.yaml")
    assert ended.code == 0, ended.output
    text = ended.about
    assert (text["sync"], text["factor"]) == ("paced", 4.0)


@pytest.mark.slow
def test_killing_a_node_is_an_error_of_its_run_only(ros, run, alive, tmp_path: Path) -> None:
    (tmp_path / "other.scenario.yaml").write_text((tmp_path / "short.scenario.yaml").read_text())
    tag = f"run{os.getpid()}"
    with ThreadPoolExecutor(1) as pool:
        words = ["--launch", ros.node("navigator", "-p", f"tag:={tag}")]
        options = ("other.scenario.yaml", "--jobs", "2")
        call = pool.submit(run, *words, scenario="short.scenario.yaml", options=options)
        while len(nodes := alive(tag, f"{ros.python} {NODES}")) < 2 and not call.done():
            time.sleep(0.05)
        os.kill(nodes[0], signal.SIGKILL)
        ended = call.result()
    assert ended.code == 3, ended.output
    results = json.loads((ended.out / "results.json").read_text())
    assert sorted(one["outcome"] for one in results["runs"]) == ["error", "passed"]
    assert "the launched command ended by signal 9" in ended.output, ended.output
    assert alive(tag) == []


@pytest.mark.slow
def test_a_ros_without_tf2_msgs_can_drive_nodes_that_do_not_need_tf(ros, run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(NODES.with_name("without")))
    ended = run("--launch", ros.node("navigator"), scenario="short.scenario.yaml")
    assert ended.code == 0, ended.output
    assert ended.about["not_published"] == ["/tf (tf2_msgs/msg/TFMessage)", "/tf_static (tf2_msgs/msg/TFMessage)"]


@pytest.mark.slow
def test_a_node_that_needs_tf_is_named_if_the_adapter_has_no_tf2_msgs(
    with_interfaces, run, monkeypatch: pytest.MonkeyPatch
) -> None:
    launch = f"env -u PYTHONPATH {with_interfaces.node('navigator')}"
    monkeypatch.setenv("PYTHONPATH", str(NODES.with_name("without")))
    ended = run("--launch", launch)
    assert ended.code == 3
    assert "/navigator subscribes to /tf_static, which cannot be published: " in ended.output
    assert "has no tf2_msgs; install it" in ended.output


@pytest.mark.slow
def test_a_node_that_hangs_is_named_and_ended(ros, run, alive) -> None:
    tag = f"hangs{os.getpid()}"
    launch = ros.node("navigator", "-p", f"tag:={tag}", hangs_at=1.0)
    ended = run("--answer", "2", "--launch", launch, scenario="short.scenario.yaml")
    assert ended.code == 3
    assert "/navigator has not answered for 2 s: it hangs, or was killed" in ended.output
    assert alive(tag) == []


CHANGES = """\
simscen: 1
world: room.world.yaml
robot: {pose: start}
goals: [{name: far, pose: door, timeout: 60 s}, {name: last, pose: desk, timeout: 60 s}]
events:
  - when: {time: 2 s}
    do: {new_goal: {name: near, pose: {x: 1.4, y: 2.2, yaw: 60 deg}}}
  - when: {time: 9 s}
    do: {cancel_goal: {}}
pass: [{goals_reached: {goals: [near]}}, {result: {status: CANCELED}}, {collisions: {max: 0}}]
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "action",
    ["", *map(slow_value, ("navigate_to_pose", "navigate_through_poses"))],
)
def test_goals_are_preempted_and_canceled(with_interfaces, run, tmp_path: Path, action: str) -> None:
    (tmp_path / "changes.scenario.yaml").write_text(CHANGES)
    launch = with_interfaces.node("navigator", **({"action": action} if action else {}))
    words = ["--goals", action or "goal_pose", "--launch", launch]
    ended = run(*words, scenario="changes.scenario.yaml")
    assert ended.code == 0, ended.output
    kinds = [event.kind.value for event in read_run(ended.logs[0]).trace.events]
    goals = [kind for kind in kinds if kind.startswith(("goal.", "navigation."))]
    again = ["goal.accepted", "goal.canceled"]
    assert goals == [*again, "goal.accepted", "goal.reached", *again, "navigation.ended"]
