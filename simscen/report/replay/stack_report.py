"""Behavior tree, log lines, and parameters that an external stack reported, for the replay page."""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from simscen.core.records.trace import LogLine
from simscen.peer.messages import BEHAVIOR_TREE_LOGGER
from simscen.record.log_reader import Log
from simscen.report.display_text import escape_control, one_line
from simscen.report.replay.packed_columns import PackedColumns

MAX_TREE_CHANGES = 20_000
"""Maximum number of changes of a behavior tree.

If there are more, nodes that are never RUNNING (conditions) are omitted. If there are still too many, the first changes
are omitted as well.
"""
_RUNNING = "RUNNING"
MAX_LINES, MAX_LINE_CHARACTERS = 1000, 400
"""Maximum number of log lines, and maximum length of a line."""
MAX_PARAMETERS, MAX_VALUE_CHARACTERS = 3000, 300
"""Maximum number of parameters of all nodes together, and maximum length of a value."""
_WARNING, _ERROR = 30, 40
"""Levels in rcl_interfaces/msg/Log."""
_TREE_CHANGE = re.compile(r"(.*): (\w+) -> (\w+)", re.DOTALL)

NODE_ORDER = (
    *("bt_navigator", "controller_server", "planner_server", "smoother_server", "behavior_server"),
    *("local_costmap", "global_costmap", "amcl", "map_server", "waypoint_follower"),
)
"""Nodes of Nav2 that the page lists first."""
MAIN_PARAMETERS = frozenset(
    (
        *("plugin", "plugins", "filters", "planner_plugins", "controller_plugins", "behavior_plugins"),
        *("default_nav_to_pose_bt_xml", "default_nav_through_poses_bt_xml"),
        *("controller_frequency", "expected_planner_frequency", "failure_tolerance", "failure_timeout"),
        *("desired_linear_vel", "max_vel_x", "max_vel_theta", "vx_max", "wz_max", "max_rotational_vel"),
        *("xy_goal_tolerance", "yaw_goal_tolerance", "required_movement_radius", "movement_time_allowance"),
        *("tolerance", "allow_unknown", "lookahead_dist", "use_collision_detection", "motion_model"),
        *("robot_radius", "footprint", "footprint_padding", "resolution", "width", "height", "update_frequency"),
        *("inflation_radius", "cost_scaling_factor", "obstacle_max_range", "observation_sources"),
        *("min_particles", "max_particles", "robot_model_type", "laser_model_type", "transform_tolerance"),
        *("update_min_a", "update_min_d", "recovery_alpha_fast", "recovery_alpha_slow"),
    )
)  # fmt: skip
"""Main parameters (last part of the name), which the page lists first: plugins, speeds, tolerances, and sizes."""


def behavior_tree_data(log: Log, columns: PackedColumns) -> dict[str, Any] | None:
    """Return the changes of the behavior tree in order: tick, node, previous and new status; None without changes."""
    changes = list(_tree_changes(log))
    if not changes:
        return None
    kept = changes
    if len(changes) > MAX_TREE_CHANGES:
        running = {node for _, node, _, after in changes if after == _RUNNING}
        kept = [change for change in changes if change[1] in running][-MAX_TREE_CHANGES:]
    columns.note_reduction("changes of the behavior tree, without conditions", len(kept), len(changes))
    nodes = {node: number for number, node in enumerate(dict.fromkeys(change[1] for change in kept))}
    names = dict.fromkeys(status for change in kept for status in change[2:])
    statuses = {status: number for number, status in enumerate(names)}
    return {
        "nodes": [one_line(node) for node in nodes],
        "statuses": [status.lower() for status in statuses],
        "ticks": columns.add([tick for tick, *_ in kept]),
        "node": columns.add([nodes[node] for _, node, _, _ in kept]),
        "before": columns.add([statuses[before] for _, _, before, _ in kept]),
        "status": columns.add([statuses[after] for *_, after in kept]),
    }


def _tree_changes(log: Log) -> Iterator[tuple[int, str, str, str]]:
    """Yield (tick, node, previous status, new status) of each change of the behavior tree."""
    for tick, line in log.sensors.stack_lines():
        if match := _tree_change(line):
            yield tick, match[1], match[2], match[3]


def log_lines_data(log: Log, columns: PackedColumns) -> list[list[Any]]:
    """Return the last log lines of the stack (tick, severity, logger, text) without changes of the behavior tree."""
    lines = [(tick, line) for tick, line in log.sensors.stack_lines() if not _tree_change(line)]
    kept = lines[-MAX_LINES:]
    columns.note_reduction("log lines of the stack, the last ones", len(kept), len(lines))
    return [
        [
            tick,
            "error" if line.level >= _ERROR else "warning" if line.level >= _WARNING else "info",
            one_line(line.name),
            _shortened(one_line(line.text), MAX_LINE_CHARACTERS),
        ]
        for tick, line in kept
    ]


def _tree_change(line: LogLine) -> re.Match[str] | None:
    """Return the match of _TREE_CHANGE if the line is a change of the behavior tree; otherwise None."""
    return _TREE_CHANGE.fullmatch(line.text) if line.name == BEHAVIOR_TREE_LOGGER else None


def parameters_data(log: Log, columns: PackedColumns) -> list[dict[str, Any]]:
    """Return the parameters of each node; [] if the stack reported none.

    For each parameter, `values` has the name, the value as text, and whether it is a main parameter. `total` is the
    number of parameters of the node before the reduction to MAX_PARAMETERS.
    """
    nodes = _reported_parameters(log)
    total = sum(map(len, nodes.values()))
    budget = MAX_PARAMETERS
    data = []
    for node in sorted(nodes, key=_node_rank):
        names = sorted(nodes[node], key=lambda name: (not is_main_parameter(name), name))[:budget]
        budget -= len(names)
        rows = [[one_line(name), _value_text(nodes[node][name]), is_main_parameter(name)] for name in sorted(names)]
        data.append({"node": one_line(node), "values": rows, "total": len(nodes[node])})
    columns.note_reduction("parameters of the stack", MAX_PARAMETERS - budget, total)
    return data


def _reported_parameters(log: Log) -> dict[str, Mapping[str, Any]]:
    """Return the reported parameter values by node and name, without malformed and empty nodes."""
    try:
        about = json.loads(log.stack.get("about", "{}"))
    except ValueError:
        return {}
    nodes = about.get("parameters") if isinstance(about, dict) else None
    if not isinstance(nodes, dict):
        return {}
    return {node: values for node, values in nodes.items() if isinstance(values, dict) and values}


def is_main_parameter(name: str) -> bool:
    """Return whether a parameter such as `FollowPath.desired_linear_vel` is one of MAIN_PARAMETERS."""
    return name.rpartition(".")[2] in MAIN_PARAMETERS


def _node_rank(node: str) -> tuple[int, str]:
    """Return the sort key of a node: index in NODE_ORDER, then name."""
    name = node.rpartition("/")[2]
    return NODE_ORDER.index(name) if name in NODE_ORDER else len(NODE_ORDER), node


def _value_text(value: object) -> str:
    """Return a parameter value as text: strings without quotes, blank strings and other values as JSON."""
    text = value if isinstance(value, str) and value.strip() else json.dumps(value, ensure_ascii=False)
    return _shortened(escape_control(text), MAX_VALUE_CHARACTERS)


def _shortened(text: str, max_characters: int) -> str:
    """Return the first `max_characters` of a text, followed by its length if it is longer."""
    return text if len(text) <= max_characters else f"{text[:max_characters]} … ({len(text)} characters)"
