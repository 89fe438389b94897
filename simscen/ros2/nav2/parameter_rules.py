"""Rules that check whether parameters of Nav2's nodes match the clock, topics, types, and frames of simscen.

The rules apply to parameter files and to running nodes. https://docs.nav2.org/configuration/ describes the parameters.
"""

from typing import Any, Collection, Iterable, List, Mapping, NamedTuple, Optional, Sequence

MAP, ODOM = "map", "odom"


class ParameterProblem(NamedTuple):
    """A wrong parameter of a node, and the reason. A severe problem prevents Nav2 from working."""

    node: str
    parameter: str
    message: str
    is_severe: bool = True


class PublishedNames(NamedTuple):
    """Names that simscen uses in the user's graph.

    scans:        topics on which simscen publishes scans
    odometry:     topic on which simscen publishes odometry
    base_frames:  names of the robot's base frame
    namespace:    namespace of relative topic names, such as `/robot1`
    """

    scans: Sequence[str]
    odometry: str
    base_frames: Sequence[str]
    namespace: str = ""


Parameters = Mapping[str, Any]
"""Parameters of one node by dotted name, e.g. `obstacle_layer.scan.topic`."""
COSTMAPS = ("global_costmap", "local_costmap")
"""Nodes of Nav2's costmaps."""
CHECKED_NODES = (
    *("amcl", "bt_navigator", "controller_server", "velocity_smoother", "behavior_server", "collision_monitor"),
    *COSTMAPS,
)
"""Nodes whose frames and topics are checked."""
Subscriptions = Mapping[str, Collection[str]]
"""Topics to which each node subscribes, by name of the node."""


def check(
    nodes: Mapping[str, Parameters], published: PublishedNames, subscriptions: Optional[Subscriptions] = None
) -> List[ParameterProblem]:
    """Return all problems in the parameters of Nav2's nodes.

    Keys of `nodes` and `subscriptions` are node names without namespace. A wrong topic name is a problem only if the
    node subscribes to this topic, or if `subscriptions` is None.
    """
    problems: List[ParameterProblem] = []
    for name in sorted(nodes):
        subscribed = None if subscriptions is None else subscriptions.get(name, ())
        node = _Node(name, nodes[name], published, subscribed, problems)
        if node.get("use_sim_time") is False:
            node.add_problem("use_sim_time", "is false: the node would use wall time", is_severe=False)
        if name not in CHECKED_NODES:
            continue
        for key in ("base_frame_id", "robot_base_frame"):
            node.check_base(key)
        for key in ("odom_frame_id", "local_frame"):
            node.check_frame(key, ODOM)
        node.check_frame("global_frame_id", MAP)
        node.check_frame("global_frame", *([MAP] if name == "bt_navigator" else [MAP, ODOM]))
        node.check_topic("scan_topic", published.scans, "scans")
        node.check_topic("odom_topic", [published.odometry], "odometry")
        if name in COSTMAPS:
            for layer in node.items("plugins"):
                sources = node.get(f"{layer}.observation_sources")
                if isinstance(sources, str) and node.get(f"{layer}.enabled") is not False:
                    for source in sources.split():
                        _check_source(node, f"{layer}.{source}")
        if name == "collision_monitor":
            for source in node.items("observation_sources"):
                _check_source(node, str(source))
    return problems


def relevant_parameters(node: str, names: Iterable[str]) -> List[str]:
    """Return the parameters among `names` that the rules use for this node."""
    has_sources = node in COSTMAPS or node == "collision_monitor"
    return [
        name for name in names if name in _CHECKED_PARAMETERS or (has_sources and name.endswith(_SOURCE_PARAMETERS))
    ]


_CHECKED_PARAMETERS = frozenset(
    (
        *("use_sim_time", "robot_base_frame", "base_frame_id", "odom_frame_id", "global_frame", "global_frame_id"),
        *("local_frame", "odom_topic", "scan_topic", "observation_sources", "plugins"),
    )
)
_SOURCE_PARAMETERS = (".observation_sources", ".topic", ".data_type", ".type", ".enabled")
"""Ends of the names of parameters that describe observation sources."""


class _Node(NamedTuple):
    """Parameters of one node, and checks that add problems to a list."""

    name: str
    parameters: Parameters
    published: PublishedNames
    subscribed: Optional[Collection[str]]
    problems: List[ParameterProblem]

    def get(self, key: str) -> Optional[Any]:
        """Return the value of a parameter; None if it is not set."""
        return self.parameters.get(key)

    def items(self, key: str) -> List[Any]:
        """Return the items of a parameter that is a list; [] if it is not set. Adds a problem for another type."""
        value = self.get(key)
        if value is None or isinstance(value, list):
            return value or []
        self.add_problem(key, f"is {value!r}; expected a list of names")
        return []

    def add_problem(self, key: str, message: str, is_severe: bool = True) -> None:
        self.problems.append(ParameterProblem(self.name, key, f"{key} {message}", is_severe))

    def check_base(self, key: str) -> None:
        """Add a problem if the parameter is set, but not to a name of the base frame."""
        value = self.get(key)
        if value is not None and value not in self.published.base_frames:
            hint = f"with --base-frame {value}, it gets this name as well"
            self.add_problem(key, f"is {value!r}; simscen's base frame is {self.published.base_frames[0]!r}: {hint}")

    def check_frame(self, key: str, *frames: str) -> None:
        """Add a problem if the parameter is set to another frame."""
        value = self.get(key)
        if value is not None and value not in frames:
            self.add_problem(key, f"is {value!r}; expected {' or '.join(map(repr, frames))}")

    def check_topic(self, key: str, topics: Sequence[str], kind: str) -> None:
        """Add a problem if the parameter is set to a topic that is not in `topics`, and the node subscribes to it.

        `kind` is the content of the topics, e.g. "scans".
        """
        value = self.get(key)
        if not isinstance(value, str):
            return
        absolute = value if value.startswith("/") else f"{self.published.namespace}/{value}"
        if absolute not in topics and (self.subscribed is None or absolute in self.subscribed):
            available = ", ".join(topics) or "none"
            self.add_problem(key, f"is {value!r}, which no node publishes; simscen's {kind}: {available}")


def _check_source(node: _Node, source: str) -> None:
    """Check an observation source of a costmap layer or of the collision monitor, unless it is disabled."""
    if node.get(f"{source}.enabled") is False:
        return
    kind = node.get(f"{source}.data_type") or node.get(f"{source}.type") or "LaserScan"
    if kind in ("LaserScan", "scan"):
        node.check_topic(f"{source}.topic", node.published.scans, "scans")
    else:
        key = f"{source}.data_type" if node.get(f"{source}.data_type") else f"{source}.type"
        node.add_problem(key, f"is {kind!r}: simscen publishes scans only", is_severe=False)


REQUIRED_NODES = ("amcl", "bt_navigator", "controller_server", "planner_server", "behavior_server", *COSTMAPS)
"""Nodes that a run needs. Another localizer that publishes map -> odom may replace `amcl`."""
