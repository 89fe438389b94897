"""Rules for Nav2's parameters, so that they match what simscen publishes; for parameter files and running nodes.

Names and defaults are those of Nav2's configuration guide (https://docs.nav2.org/configuration/).
"""

from typing import Any, Collection, Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

MAP, ODOM = "map", "odom"


class Finding(NamedTuple):
    """A wrong parameter of a node, and the reason. `severe` findings prevent Nav2 from working."""

    node: str
    parameter: str
    message: str
    severe: bool = True


class Offer(NamedTuple):
    """Topics of scans and odometry in the user's graph, and the names of the robot's base frame.

    Names of topics without a leading slash are relative to the robot's `namespace`, such as `/robot1`.
    """

    scans: Sequence[str]
    odometry: str
    bases: Sequence[str]
    namespace: str = ""


Parameters = Mapping[str, Any]
"""Parameters of one node by dotted name, e.g. `obstacle_layer.scan.topic`."""
COSTMAPS = {"local_costmap": ODOM, "global_costmap": MAP}
"""Costmaps and their usual frames."""


Subscriptions = Mapping[str, Collection[str]]
"""Topics to which each node subscribes."""


def check(
    nodes: Mapping[str, Parameters], offer: Offer, subscriptions: Optional[Subscriptions] = None
) -> List[Finding]:
    """Return all findings in the parameters of Nav2's nodes.

    Keys of `nodes` and `subscriptions` are node names without namespace. If `subscriptions` are known, a parameter with
    the name of a topic is only wrong if the node subscribes to this topic: otherwise, the topic has been remapped.
    """
    findings: List[Finding] = []
    for name in sorted(nodes):
        subscribed = None if subscriptions is None else subscriptions.get(name, ())
        node = _Node(name, nodes[name], offer, subscribed, findings)
        if node.get("use_sim_time") is False:
            node.add_finding("use_sim_time", "is false: the node would use wall time", severe=False)
        if name in RULES:
            RULES[name](node)
    return findings


def relevant_parameters(name: str, known: Iterable[str]) -> List[str]:
    """Return those of the `known` parameters of a node that the rules use."""
    if name in COSTMAPS:
        ends: Tuple[str, ...] = (".observation_sources", ".topic", ".data_type", ".enabled")
        return [key for key in known if key in _FRAMES or key == "plugins" or key.endswith(ends)]
    ends = (".topic", ".type", ".enabled")
    return [key for key in known if key in _FRAMES or (name == "collision_monitor" and key.endswith(ends))]


_FRAMES = frozenset(
    (
        *("use_sim_time", "robot_base_frame", "base_frame_id", "odom_frame_id", "global_frame", "global_frame_id"),
        *("local_frame", "odom_topic", "scan_topic", "observation_sources"),
    )
)


class _Node:
    """The parameters of one node, with functions that check them and add findings."""

    def __init__(
        self,
        name: str,
        parameters: Parameters,
        offer: Offer,
        subscribed: Optional[Collection[str]],
        findings: List[Finding],
    ) -> None:
        self.name, self.offer, self._subscribed = name, offer, subscribed
        self._parameters, self._findings = parameters, findings

    def get(self, key: str) -> Optional[Any]:
        return self._parameters.get(key)

    def add_finding(self, key: str, message: str, severe: bool = True) -> None:
        self._findings.append(Finding(self.name, key, f"{key} {message}", severe))

    def base(self, key: str) -> None:
        """Check a frame that must be the robot's base."""
        value = self.get(key)
        if value is not None and value not in self.offer.bases:
            hint = f"--base-frame {value} also gives it that name"
            self.add_finding(key, f"is {value!r}; simscen's base frame is {self.offer.bases[0]!r}: {hint}")

    def frame(self, key: str, *frames: str) -> None:
        value = self.get(key)
        if value is not None and value not in frames:
            self.add_finding(key, f"is {value!r}; expected {' or '.join(map(repr, frames))}")

    def topic(self, key: str, topics: Sequence[str], what: str) -> None:
        value = self.get(key)
        if not isinstance(value, str):
            return
        absolute = value if value.startswith("/") else f"{self.offer.namespace}/{value}"
        if absolute not in topics and (self._subscribed is None or absolute in self._subscribed):
            available = ", ".join(topics) or "none"
            self.add_finding(key, f"is {value!r}, which no node publishes; simscen's {what}: {available}")


def _amcl(node: _Node) -> None:
    node.base("base_frame_id")
    node.frame("odom_frame_id", ODOM)
    node.frame("global_frame_id", MAP)
    node.topic("scan_topic", node.offer.scans, "scans")


def _costmap(node: _Node) -> None:
    node.base("robot_base_frame")
    node.frame("global_frame", MAP, ODOM)
    for layer in node.get("plugins") or ():
        sources = node.get(f"{layer}.observation_sources")
        for source in sources.split() if isinstance(sources, str) else ():
            _source(node, f"{layer}.{source}")


def _source(node: _Node, source: str) -> None:
    """Check an observation source of a layer."""
    kind = node.get(f"{source}.data_type") or node.get(f"{source}.type") or "LaserScan"
    if kind in ("LaserScan", "scan"):
        node.topic(f"{source}.topic", node.offer.scans, "scans")
    elif node.get(f"{source}.enabled") is not False:
        key = f"{source}.data_type" if node.get(f"{source}.data_type") else f"{source}.type"
        node.add_finding(key, f"is {kind!r}: simscen publishes scans only", severe=False)


def _navigator(node: _Node) -> None:
    node.base("robot_base_frame")
    node.frame("global_frame", MAP)
    node.topic("odom_topic", [node.offer.odometry], "odometry")


def _with_odometry(node: _Node) -> None:
    node.topic("odom_topic", [node.offer.odometry], "odometry")


def _behaviors(node: _Node) -> None:
    node.base("robot_base_frame")
    node.frame("local_frame", ODOM)
    node.frame("global_frame", MAP, ODOM)


def _monitor(node: _Node) -> None:
    node.base("base_frame_id")
    node.frame("odom_frame_id", ODOM)
    for source in node.get("observation_sources") or ():
        _source(node, str(source))


RULES: Dict[str, Any] = {
    "amcl": _amcl,
    "local_costmap": _costmap,
    "global_costmap": _costmap,
    "bt_navigator": _navigator,
    "controller_server": _with_odometry,
    "velocity_smoother": _with_odometry,
    "behavior_server": _behaviors,
    "collision_monitor": _monitor,
}
NODES = ("amcl", "bt_navigator", "controller_server", "planner_server", "behavior_server", *sorted(COSTMAPS))
"""The nodes that a run needs; another localizer that publishes map -> odom may replace `amcl`."""
