"""The graph as simscen sees it: one node that publishes and keeps bytes, and who else is there."""

from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple

import rclpy
from rclpy.executors import SingleThreadedExecutor

from simscen.ros2 import interfaces, quality
from simscen.ros2.names import Names

NODE = "simscen"


class Heard(NamedTuple):
    """A message of the stack: topic of the protocol, type, CDR."""

    topic: str
    type: str
    data: bytes


class Topic(NamedTuple):
    """A topic of the protocol and its type."""

    name: str
    type: str


class End(NamedTuple):
    """A publisher or a subscriber of somebody else."""

    node: str
    type: str
    quality: Any


class Graph:
    """One node in one ROS domain."""

    def __init__(self, names: Names, watch: Callable[[], None]) -> None:
        self.names, self._watch = names, watch
        self.node = rclpy.create_node(NODE, namespace=names.namespace or None, use_global_arguments=False)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self._publishers: Dict[str, Any] = {}
        self._subscriptions: Dict[str, Tuple[str, Any]] = {}
        self.inbox: List[Heard] = []

    @property
    def offered(self) -> Dict[str, Any]:
        """The publishers, by topic of the protocol."""
        return self._publishers

    def offer(self, topic: str, type_: str) -> bool:
        """Make a publisher; False where the distribution has no such type."""
        kind = interfaces.find(type_)
        if kind is None:
            return False
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(kind, self.names(topic), quality.offered(topic))
        return True

    def publish(self, topic: str, data: bytes) -> bool:
        """Publish CDR on a topic that was offered; whether anybody subscribes to it."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            return False
        publisher.publish(data)
        return bool(publisher.get_subscription_count())

    def hear(self, topic: str, type_: str) -> None:
        """Keep all that comes on a topic, with a quality of service that its publishers have."""
        known = self._subscriptions.get(topic)
        kind = interfaces.find(type_)
        if kind is None or (known is not None and known[0] == type_):
            return
        if known is not None:
            self.node.destroy_subscription(known[1])
        publishers = self.node.get_publishers_info_by_topic(self.names(topic))

        def keep(data: bytes) -> None:
            self.inbox.append(Heard(topic, type_, bytes(data)))

        profile = quality.heard([end for end in publishers if end.node_name != NODE])
        made = self.node.create_subscription(kind, self.names(topic), keep, profile, raw=True)
        self._subscriptions[topic] = (type_, made)

    def turn(self, seconds: float = 0.0) -> None:
        """Take what has come; wait at most so long for something to come."""
        self.executor.spin_once(timeout_sec=seconds)

    def take_all(self) -> None:
        """Take all that has come, and wait for nothing."""
        while True:
            before = len(self.inbox)
            self.turn()
            if len(self.inbox) == before:
                return

    def until(self, done: Callable[[], bool], seconds: float, clock: Callable[[], float]) -> bool:
        """Take what comes until `done`; False when that took longer than `seconds` of `clock`.

        `watch` is called all the while, and may raise.
        """
        end = clock() + seconds
        while not done():
            left = end - clock()
            if left <= 0:
                return False
            self.turn(min(left, 0.1))
            self._watch()
        return True

    # Who else is there

    def nodes(self) -> List[Tuple[str, str]]:
        """(name, namespace) of all nodes but this one and hidden ones, sorted."""
        there = self.node.get_node_names_and_namespaces()
        return sorted({(n, s) for n, s in there if n != NODE and not n.startswith("_")})

    def publishers(self, name: str) -> List[End]:
        """Who publishes on a topic of the graph."""
        return _ends(self.node.get_publishers_info_by_topic(name))

    def subscribers(self, name: str) -> List[End]:
        """Who subscribes to a topic of the graph."""
        return _ends(self.node.get_subscriptions_info_by_topic(name))

    def topics(self) -> Dict[str, List[str]]:
        """All topics of the graph and their types."""
        return dict(self.node.get_topic_names_and_types())

    def service(self, node: Tuple[str, str], name: str) -> Optional[str]:
        """The type of a node's service `~/name`; None where it has none."""
        try:
            services = self.node.get_service_names_and_types_by_node(*node)
        except rclpy.node.NodeNameNonExistentError:
            return None
        wanted = f"{full(node)}/{name}"
        return next((types[0] for found, types in services if found == wanted), None)

    def close(self) -> None:
        """Leave the graph."""
        self.executor.shutdown(timeout_sec=0)
        self.node.destroy_node()


def full(node: Tuple[str, str]) -> str:
    """`/namespace/name` of (name, namespace)."""
    return f"{node[1].rstrip('/')}/{node[0]}"


def _ends(infos: List[Any]) -> List[End]:
    found = {
        (full((info.node_name, info.node_namespace)), info.topic_type): End(
            full((info.node_name, info.node_namespace)), info.topic_type, info.qos_profile
        )
        for info in infos
        if info.node_name != NODE
    }
    return [found[key] for key in sorted(found)]
