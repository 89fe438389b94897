"""Records about Nav2 for the run's log: behavior tree transitions, warnings, and parameters of Nav2's nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, NamedTuple

from simscen.peer.messages import BEHAVIOR_TREE_LOGGER, tree_change
from simscen.ros2.messages import find_type
from simscen.ros2.node_parameters import NodeParameters

if TYPE_CHECKING:
    from simscen.ros2.graph import Graph
    from simscen.ros2.node_barrier import NodeBarrier

BEHAVIOR_TREE_LOG = "/behavior_tree_log"
ROSOUT = "/rosout"
INFO, WARNING, ERROR = 20, 30, 40
"""Levels of rcl_interfaces/msg/Log."""
MAX_LISTED_ERRORS = 3
"""Maximum number of errors that `errors` returns."""
ABORTED_BRING_UP = "Aborting bringup"
"""Text that Nav2's lifecycle manager logs when it gives up the start of its nodes."""
RECORDED_NODES = (
    *("amcl", "map_server", "planner_server", "controller_server", "smoother_server", "behavior_server"),
    *("bt_navigator", "waypoint_follower", "velocity_smoother", "collision_monitor"),
    *("local_costmap", "global_costmap"),
)
"""Names of the nodes whose parameters are recorded."""
OMITTED_PREFIXES = ("use_sim_time", "qos_overrides.")
"""Parameters whose names begin with one of these texts are not recorded."""


class LogLine(NamedTuple):
    """A line for /rosout of the run's log: level, name of the logger, and text."""

    level: int
    name: str
    text: str


class Nav2Report:
    """Collects log lines of Nav2's nodes during the run, and reads the parameters of these nodes once at the start."""

    def __init__(self, graph: Graph, barrier: NodeBarrier) -> None:
        self._graph, self._barrier = graph, barrier
        self._node_parameters = NodeParameters(graph, barrier)
        self._lines: list[LogLine] = []
        self._follows_log = False
        self.parameters: dict[str, dict[str, Any]] = {}
        """Recorded values by full name of the node and name of the parameter."""
        self.aborted_bring_up = ""
        """Name of the lifecycle manager that has given up starting its nodes; empty if none has."""

    def begin(self) -> None:
        """Discard the collected lines, subscribe to the logs, and read the parameters of Nav2's nodes."""
        self._follow(self._graph.names(BEHAVIOR_TREE_LOG), "nav2_msgs/msg/BehaviorTreeLog", self._add_tree_changes)
        self.follow_log()
        self._lines.clear()
        for node in self._barrier.nodes:
            if node.rpartition("/")[2] in RECORDED_NODES:
                names = [name for name in self._node_parameters.names(node) if not name.startswith(OMITTED_PREFIXES)]
                self.parameters[node] = self._node_parameters.values(node, names)

    def follow_log(self) -> None:
        """Subscribe to /rosout if a node publishes it. The caller repeats this, because nodes may start later."""
        if not self._follows_log:
            self._follows_log = self._follow(ROSOUT, "rcl_interfaces/msg/Log", self._add_log_line)

    def errors(self) -> list[str]:
        """Return the last MAX_LISTED_ERRORS different errors since the last `take_lines`."""
        errors = dict.fromkeys(f"{line.name}: {line.text}" for line in self._lines if line.level >= ERROR)
        return list(errors)[-MAX_LISTED_ERRORS:]

    def take_lines(self) -> list[LogLine]:
        """Return the lines since the last call, sorted by logger."""
        lines, self._lines = self._lines, []
        return sorted(lines, key=lambda line: line.name)

    def _follow(self, topic: str, type_name: str, callback: Callable[[Any], None]) -> bool:
        """Subscribe to a topic. Return False if no node publishes the topic, or its type is not installed."""
        message_type = find_type(type_name)
        if message_type is None or not self._graph.publishers_of(topic):
            return False
        self._graph.node.create_subscription(message_type, topic, callback, self._graph.subscription_profile(topic))
        return True

    def _add_tree_changes(self, message: Any) -> None:
        for change in message.event_log:
            text = tree_change(change.node_name, change.previous_status, change.current_status)
            self._lines.append(LogLine(INFO, BEHAVIOR_TREE_LOGGER, text))

    def _add_log_line(self, message: Any) -> None:
        """Add a message of /rosout if it is a warning or an error, and notice an aborted bring-up."""
        if message.level >= WARNING:
            self._lines.append(LogLine(message.level, message.name, message.msg))
        if ABORTED_BRING_UP in message.msg:
            self.aborted_bring_up = message.name
