"""Invented report of Nav2 during a drive: changes of the behavior tree, log lines, and parameters."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from simscen.core.clock import Clock
from simscen.peer.messages import BEHAVIOR_TREE_LOGGER, log, tree_change
from simscen.record.log_reader import Log

PARAMETERS: dict[str, dict[str, Any]] = {
    "/amcl": {"base_frame_id": "base_link", "laser_max_range": 100.0, "max_particles": 2000},
    "/controller_server": {
        "FollowPath.desired_linear_vel": 0.4,
        "FollowPath.plugin": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
        "FollowPath.use_velocity_scaled_lookahead_dist": False,
        "controller_plugins": ["FollowPath"],
        "odom_topic": "/odom",
    },
    "/local_costmap/local_costmap": {"inflation_layer.inflation_radius": 0.55, "plugins": [], "rolling_window": True},
}
ROOT_NODES = ("NavigateRecovery", "NavigateWithReplanning")
NAV2_ROOT, INFO, WARNING, ERROR = "NavigateRecovery", 20, 30, 40


def tree_changes(seconds: float) -> Iterator[tuple[float, str, str, str]]:
    """Yield changes of node status: time in s, node, old status, and new status.

    The tree plans once per second, and its controller fails at three quarters of the time.
    """
    for node in ROOT_NODES:
        yield 0.1, node, "IDLE", "RUNNING"
    failure = round(0.75 * seconds, 2)
    second = 0.2
    while second < failure:
        yield second, "ComputePathToPose", "IDLE", "RUNNING"
        yield second + 0.05, "ComputePathToPose", "RUNNING", "SUCCESS"
        if second == 0.2:
            yield second + 0.05, "FollowPath", "IDLE", "RUNNING"
        yield second + 0.1, "ComputePathToPose", "SUCCESS", "IDLE"
        second += 1.0
    yield failure, "FollowPath", "RUNNING", "FAILURE"
    yield failure, "FollowPath", "FAILURE", "IDLE"
    yield failure, "Spin", "IDLE", "RUNNING"
    yield failure + 1.0, "Spin", "RUNNING", "IDLE"


def with_nav2_report(
    log_: Log, parameters: Mapping[str, Mapping[str, Any]] = PARAMETERS, lines: tuple[tuple[int, str], ...] = ()
) -> Log:
    """Return the log with the report of Nav2, and with further lines (severity, text) at its end."""
    rate, time = log_.trace.tick_rate, Clock(log_.trace.tick_rate)
    end = log_.trace.end
    messages = [
        (round(seconds * rate), INFO, BEHAVIOR_TREE_LOGGER, tree_change(*change))
        for seconds, *change in tree_changes(end / rate)
    ]
    failure = next(message for message in messages if message[3].endswith("FAILURE"))
    messages.insert(messages.index(failure), (failure[0], ERROR, "controller_server", "Failed to make progress"))
    messages += [(end, severity, "amcl", text) for severity, text in lines]
    serialized = [(tick, log(time.stamp(tick), *line)) for tick, *line in messages]
    about = json.dumps({"parameters": parameters}, sort_keys=True)
    sensors = replace(log_.sensors, log_lines=serialized)
    return replace(log_, sensors=sensors, stack={"external": "nav2", "about": about})
