"""simscen's own ROS node, which publishes and receives serialized (CDR) messages, and lists the other nodes.

While the run waits for nodes to become ready, ROS time advances, but simulated time does not. `Graph.offset_ns` is ROS
time minus simulated time. The graph adds this offset to the stamps of published messages, and subtracts it from the
stamps of received messages.
"""

import time
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Set, Tuple

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from simscen.ros2.graph_names import TopicNames
from simscen.ros2.messages import find_type, shift_stamps, write_clock

NODE_NAME = "simscen"
"""Name of simscen's own node."""
UNKNOWN_NODE_NAME = "_NODE_NAME_UNKNOWN_"
"""Name that ROS gives to a node if it discovers the node's publishers or subscriptions before the node."""
CLOCK = "/clock"
LATCHED_TOPICS = frozenset(
    (
        *("/map", "/tf_static", "/robot_description", "/keepout_filter_mask", "/speed_filter_mask"),
        *("/keepout_costmap_filter_info", "/speed_costmap_filter_info"),
    )
)
"""Topics that are published with transient local durability, so that later subscribers receive the last message."""
QUEUE_DEPTHS = {"/tf": 100, "/imu": 100}
"""QoS history depths of topics with a high rate, by topic."""
DEFAULT_QUEUE_DEPTH = 10
"""QoS history depth of other topics that are not latched."""
Node = Tuple[str, str]
"""Name and namespace of a node."""


class ReceivedMessage(NamedTuple):
    """A message from the nodes: topic of the stack protocol, name of the type, and serialized (CDR) data."""

    topic: str
    type: str
    data: bytes


class Topic(NamedTuple):
    """A topic of the stack protocol, and its type. The topic may have another name in the graph."""

    name: str
    type: str


class Endpoint(NamedTuple):
    """A publisher or subscription of another node: full name of the node, message type, and QoS profile."""

    node: str
    type: str
    qos: Any


STATUS_TYPE = "action_msgs/msg/GoalStatusArray"


class CountingExecutor(SingleThreadedExecutor):  # type: ignore[misc]  # rclpy is not installed here
    """Executor that counts the events that it handles."""

    handled_count = 0

    def wait_for_ready_callbacks(self, *args: Any, **kwargs: Any) -> Any:
        """Return the callback of the next event, as the base class does. Raises an exception if there is no event."""
        ready = super().wait_for_ready_callbacks(*args, **kwargs)
        self.handled_count += 1
        return ready


class Graph:
    """simscen's node in one ROS domain.

    Parameters `topic` are topics of the stack protocol. Parameters `name` are names in the graph, after remapping.
    """

    def __init__(self, names: TopicNames, check_alive: Callable[[], None]) -> None:
        """`check_alive` is called repeatedly while waiting, and may raise an exception to end the wait."""
        self.names, self._check_alive = names, check_alive
        self.node = rclpy.create_node(NODE_NAME, namespace=names.namespace or None, use_global_arguments=False)
        self.executor = CountingExecutor()
        self.executor.add_node(self.node)
        self.publishers: Dict[str, Any] = {}
        self.types: Dict[str, str] = {}
        """Types of the publishers. The keys of `publishers` and `types` are topics of the protocol."""
        self._subscriptions: Dict[str, Tuple[str, Any]] = {}
        self.inbox: List[ReceivedMessage] = []
        """Received messages in the order of arrival, until the caller removes them."""
        self.offset_ns = 0
        """ROS time minus simulated time."""

    def advertise(self, topic: str, type_name: str) -> bool:
        """Create a publisher; return False if the type is not installed."""
        message_type = find_type(type_name)
        if message_type is None:
            return False
        if topic not in self.publishers:
            self.publishers[topic] = self.node.create_publisher(message_type, self.names(topic), publisher_qos(topic))
            self.types[topic] = type_name
        return True

    def publish(self, topic: str, data: bytes) -> bool:
        """Publish a message, and return whether the topic has subscribers. Ignores topics that are not advertised."""
        publisher = self.publishers.get(topic)
        if publisher is None:
            return False
        publisher.publish(shift_stamps(self.types[topic], data, self.offset_ns))
        return bool(publisher.get_subscription_count())

    def publish_clock(self, now: int) -> None:
        """Publish ROS time on /clock: the simulated time `now` in ns plus `offset_ns`."""
        self.publish(CLOCK, write_clock(now + self.offset_ns))

    def subscribe(self, topic: str, type_name: str) -> None:
        """Add all messages of a topic to `inbox` from now on. Replaces a subscription with another type."""
        message_type = find_type(type_name)
        existing = self._subscriptions.get(topic)
        if message_type is None or (existing is not None and existing[0] == type_name):
            return
        if existing is not None:
            self.node.destroy_subscription(existing[1])

        def callback(data: bytes) -> None:
            self.inbox.append(ReceivedMessage(topic, type_name, shift_stamps(type_name, bytes(data), -self.offset_ns)))

        profile = self.subscription_profile(self.names(topic))
        subscription = self.node.create_subscription(message_type, self.names(topic), callback, profile, raw=True)
        self._subscriptions[topic] = (type_name, subscription)

    def subscribe_to_status(self, action: str, callback: Callable[[Any], None]) -> Optional[str]:
        """Call `callback` with each GoalStatusArray of an action from now on.

        Return the full name of the server's node. If the action does not have exactly one server, return None, and do
        not subscribe.
        """
        status_type, topic = find_type(STATUS_TYPE), self.names(f"/{action}/_action/status")
        servers = self.publishers_of(topic)
        if status_type is None or len(servers) != 1:
            return None
        self.node.create_subscription(status_type, topic, callback, self.subscription_profile(topic))
        return servers[0].node

    def subscription_profile(self, name: str) -> QoSProfile:
        """Return a QoS profile for a subscription that is compatible with all publishers of other nodes."""
        return subscription_qos(
            [
                publisher
                for publisher in self.node.get_publishers_info_by_topic(name)
                if publisher.node_name != NODE_NAME
            ]
        )

    def spin_once(self, seconds: float = 0.0) -> None:
        """Handle one event of the node (message, answer, timer); wait at most `seconds` of wall time for it."""
        self.executor.spin_once(timeout_sec=seconds)

    def receive_all(self) -> None:
        """Move all messages that have arrived to `inbox`, without waiting."""
        while True:
            before = self.executor.handled_count
            self.spin_once()
            if self.executor.handled_count == before:
                return

    def spin_until(self, done: Callable[[], bool], seconds: float) -> bool:
        """Handle events until `done` returns True. Return False if that takes longer than `seconds` of wall time."""
        end = time.monotonic() + seconds
        while not done():
            remaining = end - time.monotonic()
            if remaining <= 0:
                return False
            self.spin_once(min(remaining, 0.1))
            self._check_alive()
        return True

    def nodes(self) -> List[Node]:
        """Return all other nodes that are not hidden, sorted."""
        found = self.node.get_node_names_and_namespaces()
        return sorted({(n, s) for n, s in found if n != NODE_NAME and not n.startswith("_")})

    def publishers_of(self, name: str) -> List[Endpoint]:
        """Return the publishers of a topic that belong to other nodes."""
        return _endpoints(self.node.get_publishers_info_by_topic(name))

    def subscribers_of(self, name: str) -> List[Endpoint]:
        """Return the subscriptions to a topic that belong to other nodes."""
        return _endpoints(self.node.get_subscriptions_info_by_topic(name))

    def subscribed_topics(self, node: Node) -> Set[str]:
        """Return the names of the topics to which a node subscribes; empty if the node has ended."""
        try:
            return {name for name, _ in self.node.get_subscriber_names_and_types_by_node(*node)}
        except rclpy.node.NodeNameNonExistentError:
            return set()

    def service_type(self, node: Node, name: str) -> Optional[str]:
        """Return the type of a node's service `~/name`; None if it has no such service."""
        try:
            services = self.node.get_service_names_and_types_by_node(*node)
        except rclpy.node.NodeNameNonExistentError:
            return None
        service = f"{full_name(node)}/{name}"
        return next((types[0] for found, types in services if found == service), None)

    def close(self) -> None:
        """Leave the graph."""
        self.executor.shutdown(timeout_sec=0)
        self.node.destroy_node()


def full_name(node: Node) -> str:
    """Return the full name of a node, `/namespace/name`."""
    return f"{node[1].rstrip('/')}/{node[0]}"


def _endpoints(infos: List[Any]) -> List[Endpoint]:
    """Return the endpoints of other nodes, without duplicates."""
    found = {}
    for info in infos:
        if info.node_name not in (NODE_NAME, UNKNOWN_NODE_NAME):
            node = full_name((info.node_name, info.node_namespace))
            found[node, info.topic_type] = Endpoint(node, info.topic_type, info.qos_profile)
    return [found[key] for key in sorted(found)]


def publisher_qos(topic: str) -> QoSProfile:
    """Return the QoS profile with which simscen publishes a topic."""
    is_latched = topic in LATCHED_TOPICS
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=1 if is_latched else QUEUE_DEPTHS.get(topic, DEFAULT_QUEUE_DEPTH),
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def subscription_qos(publishers: Sequence[Any]) -> QoSProfile:
    """Return a QoS profile that is compatible with all `publishers`."""
    profiles = [publisher.qos_profile for publisher in publishers]
    is_reliable = all(profile.reliability == ReliabilityPolicy.RELIABLE for profile in profiles)
    is_latched = bool(profiles) and all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in profiles)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=100,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def incompatible_policies(offered: QoSProfile, requested: QoSProfile) -> List[Tuple[str, str, str]]:
    """Return the incompatible QoS policies of a publisher and a subscription, as (policy, offered, requested)."""
    found = []
    if requested.reliability == ReliabilityPolicy.RELIABLE and offered.reliability == ReliabilityPolicy.BEST_EFFORT:
        found.append(("reliability", "best effort", "reliable"))
    if requested.durability == DurabilityPolicy.TRANSIENT_LOCAL and offered.durability == DurabilityPolicy.VOLATILE:
        found.append(("durability", "volatile", "transient local"))
    return found
