"""Tests of a real Nav2 with the parameters of nav2_bringup in shipped scenarios."""

import json
import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.reader import make_reader

from simscen.record.log_reader import read_run
from simscen.report.replay.packed_columns import PackedColumns
from simscen.report.replay.stack_report import behavior_tree_data, parameters_data

pytestmark = pytest.mark.slow
GOAL = "navigation/goal.scenario.yaml"
DWB = {
    "plugin": "dwb_core::DWBLocalPlanner",
    **{"max_vel_x": 0.26, "max_speed_xy": 0.26, "max_vel_theta": 1.0},
    **{"acc_lim_x": 2.5, "decel_lim_x": -2.5, "acc_lim_theta": 3.2, "decel_lim_theta": -3.2},
    **{"vx_samples": 20, "vtheta_samples": 20, "sim_time": 1.7, "linear_granularity": 0.05},
    "critics": ["RotateToGoal", "Oscillation", "BaseObstacle", "GoalAlign", "PathAlign", "PathDist", "GoalDist"],
    **{"BaseObstacle.scale": 0.02, "PathAlign.scale": 32.0, "PathAlign.forward_point_distance": 0.1},
    **{"GoalAlign.scale": 24.0, "GoalAlign.forward_point_distance": 0.1, "PathDist.scale": 32.0},
    **{"GoalDist.scale": 24.0, "RotateToGoal.scale": 32.0},
}
"""The controller of the parameters that nav2_bringup had up to Iron."""
SMAC_2D = {"plugin": "nav2_smac_planner::SmacPlanner2D", "tolerance": 0.125, "max_planning_time": 2.0}


def processes(word: str) -> list[int]:
    """Return the processes whose command line contains `word`."""
    found = []
    for process in Path("/proc").iterdir():
        if process.name.isdigit() and int(process.name) != os.getpid():
            try:
                words = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
            except OSError:
                continue
            if word in words:
                found.append(int(process.name))
    return sorted(found)


def test_nav2_reaches_a_goal_in_lockstep(run, nav2) -> None:
    ended = run(GOAL)
    assert ended.code == 0, ended.output
    about = ended.about
    assert about["goals"] == "/navigate_to_pose"
    assert {"/amcl", "/bt_navigator", "/controller_server", "/planner_server"} <= set(about["nodes"])
    assert "Traceback" not in ended.stack_log
    assert processes(str(nav2.params)) == []
    # No command is due before the first path, after the goal, or while the tree plans.
    assert about["without_command"] < 0.2 * about["control_periods"]


def test_the_log_contains_what_nav2_computed(run) -> None:
    """Costmaps, plans, particles, changes of the behavior tree, and the values of all parameters."""
    ended = run(GOAL)
    assert ended.code == 0, ended.output
    with next(ended.out.rglob("run.mcap")).open("rb") as file:
        summary = make_reader(file).get_summary()
    counts = {summary.channels[k].topic: n for k, n in summary.statistics.channel_message_counts.items()}
    for topic in ("/global_costmap/costmap", "/local_costmap/costmap", "/plan", "/particle_cloud", "/amcl_pose"):
        assert counts.get(topic, 0) > 1, topic
    with next(ended.out.rglob("run.mcap")).open("rb") as file:
        lines = [message.data for _, _, message in make_reader(file).iter_messages(topics=["/rosout"])]
    assert any(b"FollowPath: IDLE -> RUNNING" in line for line in lines)
    parameters = ended.about["parameters"]
    assert parameters["/controller_server"]["FollowPath.desired_linear_vel"] == 0.4
    assert parameters["/local_costmap/local_costmap"]["plugins"] == ["voxel_layer", "inflation_layer"]


def test_the_replay_page_has_the_behavior_tree_and_the_parameters(run) -> None:
    ended = run(GOAL)
    assert ended.code == 0, ended.output
    log, columns = read_run(next(ended.out.rglob("run.mcap")), with_sensors=True), PackedColumns()
    tree = behavior_tree_data(log, columns)
    assert tree is not None and {"NavigateRecovery", "ComputePathToPose", "FollowPath"} <= set(tree["nodes"])
    assert {"idle", "running", "success"} <= set(tree["statuses"])
    values = {node["node"]: {name: text for name, text, _ in node["values"]} for node in parameters_data(log, columns)}
    assert values["/controller_server"]["FollowPath.desired_linear_vel"] == "0.4"


def test_nav2_becomes_active_although_scans_are_delayed(run) -> None:
    ended = run("faults/lidar_delay.scenario.yaml")
    # AMCL's error is close to the limit of the scenario.
    assert verdicts_of(ended)["goals_reached"] == "pass", ended.output


def test_recoveries_of_nav2_are_events(run) -> None:
    """The scenario expects at least one recovery before the goal fails."""
    ended = run("corner_cases/goal_blocked_for_good.scenario.yaml")
    assert ended.code == 0, ended.output


@pytest.mark.parametrize("plugins", ["dwb", "mppi", "smac_2d"])
def test_other_plugins_of_nav2_reach_the_goal(run, nav2, tmp_path: Path, plugins: str) -> None:
    server, name = ("planner_server", "GridBased") if plugins == "smac_2d" else ("controller_server", "FollowPath")
    unchanged = yaml.safe_load(nav2.unchanged_params.read_text())
    values = {"dwb": DWB, "mppi": unchanged["controller_server"]["ros__parameters"]["FollowPath"], "smac_2d": SMAC_2D}

    def change(nodes: dict[str, Any]) -> None:
        nodes[server]["ros__parameters"][name] = values[plugins]

    ended = run(GOAL, launch=nav2.with_parameters(tmp_path / "plugins.yaml", change).launch)
    assert ended.code == 0, ended.output


def test_waypoints_are_visited_by_the_waypoint_follower(run, nav2, tmp_path: Path) -> None:
    def change(nodes: dict[str, Any]) -> None:
        nodes["waypoint_follower"]["ros__parameters"]["wait_at_waypoint"]["waypoint_pause_duration"] = 0

    launch = nav2.with_parameters(tmp_path / "waypoints.yaml", change).launch
    ended = run("navigation/waypoints_with_waits.scenario.yaml", launch=launch)
    assert ended.about["goals"] == "/follow_waypoints"
    verdicts = verdicts_of(ended)
    assert verdicts["goals_reached"] == verdicts["result"] == "pass", ended.output


def verdicts_of(ended: Any) -> dict[str, str]:
    """Return the status of each criterion of the only run."""
    results = json.loads((ended.out / "results.json").read_text())
    return {verdict["criterion"]: verdict["status"] for verdict in results["runs"][0]["verdicts"]}


def test_a_wrong_frame_is_named_with_its_node(run, nav2, tmp_path: Path) -> None:
    def misspell(nodes: dict[str, Any]) -> None:
        nodes["amcl"]["ros__parameters"]["base_frame_id"] = "base_fotprint"

    changed = nav2.with_parameters(tmp_path / "typo.yaml", misspell)
    ended = run(GOAL, "--ready", "10", launch=changed.launch)
    assert ended.code == 3
    assert "amcl: base_frame_id is 'base_fotprint'" in ended.output
    assert processes(str(changed.params)) == []


def test_a_scenario_without_a_map_is_named_as_the_cause(run) -> None:
    ended = run("corner_cases/u_trap.scenario.yaml", "--ready", "20")
    assert ended.code == 3
    assert "waiting for /map, which no node publishes" in ended.output


def test_a_server_that_is_killed_during_the_run_is_named(run, nav2) -> None:
    """Kill the planner server some time after the controller server has its goal."""
    params = str(nav2.params)

    def kill() -> None:
        while not (found := processes(f"planner_server --ros-args --params-file {params}")):
            time.sleep(0.1)
        time.sleep(25)
        os.kill(found[0], signal.SIGKILL)

    threading.Thread(target=kill, daemon=True).start()
    ended = run(GOAL)
    assert ended.code == 3, ended.output
    assert "planner_server" in ended.output
    assert processes(params) == []
