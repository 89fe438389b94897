"""Checks whether the nodes of the user's graph are ready for a run."""

from typing import Any, Iterable, List, Optional, Sequence, Set, Tuple

from simscen.ros2.goal_sender import GOAL_POSE, GoalPoseSender, GoalSenders
from simscen.ros2.graph import Endpoint, Graph, Topic, full_name, incompatible_policies
from simscen.ros2.messages import ODOMETRY_TYPE, find_type
from simscen.ros2.nav2.parameter_rules import REQUIRED_NODES
from simscen.ros2.nav2.readiness import Nav2Readiness
from simscen.ros2.node_barrier import POLL_S, NodeBarrier, ServicePoll
from simscen.ros2.options import Options
from simscen.ros2.user_transforms import UserTransforms

COMMAND = "/cmd_vel"
TWIST_TYPE, TWIST_STAMPED_TYPE = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
MAP = "/map"
STATE_SERVICE = "lifecycle_msgs/srv/GetState"
ACTIVE = 3
"""lifecycle_msgs/msg/State.PRIMARY_STATE_ACTIVE."""
SHARED_TOPICS = ("/tf", "/tf_static", "/initialpose", GOAL_POSE)
"""Topics that several nodes may publish."""


class Readiness:
    """Checks of the ROS graph before a run. Each check returns one text for each problem that it finds."""

    def __init__(
        self,
        graph: Graph,
        barrier: NodeBarrier,
        topics: Sequence[Topic],
        senders: GoalSenders,
        options: Options,
        base_frames: Sequence[str],
    ) -> None:
        """`topics` are published by simscen. `base_frames` are the names of the base frame in the graph."""
        self._graph, self._barrier, self._topics, self._senders = graph, barrier, list(topics), senders
        self._options = options
        self._states = ServicePoll(graph, STATE_SERVICE, "get_state") if find_type(STATE_SERVICE) else None
        self._nav2 = Nav2Readiness(graph, barrier, topics, options, base_frames)
        self._user_transforms: Optional[UserTransforms] = None
        self.has_map = True
        """Whether simscen has published the map."""
        barrier.required_nodes = self.required_nodes

    def use_transforms(self, transforms: UserTransforms) -> None:
        """Require that the user's nodes publish `transforms`, and accept the frames in them as base frames."""
        self._user_transforms = self._nav2.user_transforms = transforms

    def empty_graph(self) -> List[str]:
        """Return a problem if the graph has no node except simscen's."""
        return [] if self._graph.nodes() else ["there is no other node in this ROS domain"]

    def problems(self) -> List[str]:
        """Return all problems that prevent the start of the run."""
        if self.empty_graph():
            return self.empty_graph()
        busy = self._barrier.poll()
        found = self._command_problems() + self._senders.problems()
        for topic in self._topics:
            found += self._incompatible_subscribers(topic) + self._other_publishers(topic)
        found += self._unused_sensors()
        found += self._user_transforms.missing_frames() if self._user_transforms is not None else []
        if self._options.nav2:
            found += self._nav2.node_problems()
            found += [] if found else self._nav2.wrong_parameters()
        return busy + found + self._nodes_on_wall_time() + self._inactive_nodes()

    def likely_causes(self) -> List[str]:
        """Return problems that may prevent nodes from becoming active: no map, and wrong parameters of Nav2's nodes."""
        return self._missing_map() + (self._nav2.wrong_parameters() if self._options.nav2 else [])

    def _missing_map(self) -> List[str]:
        """Return a problem if nodes wait for a map that no node publishes."""
        name = self._graph.names(MAP)
        if self.has_map or self._graph.publishers_of(name):
            return []
        nodes = sorted({subscriber.node for subscriber in self._graph.subscribers_of(name)})
        reason = "which no node publishes: the scenario has `map: none`, or simscen was started with --without /map"
        return [f"{', '.join(nodes)}: waiting for {name}, {reason}"] if nodes else []

    def required_nodes(self) -> Set[str]:
        """Return the full names of nodes without which the run cannot continue.

        These are lifecycle nodes, publishers of commands, subscribers of goals, and nodes that Nav2 needs.
        """
        names = {publisher.node for publisher in self._graph.publishers_of(self._graph.names(COMMAND))}
        if isinstance(self._senders.usable, GoalPoseSender):
            names |= {subscriber.node for subscriber in self._graph.subscribers_of(self._graph.names(GOAL_POSE))}
        if self._options.nav2:
            names |= {full_name(node) for node in self._graph.nodes() if node[0] in REQUIRED_NODES}
        return names | {full_name(node) for node in self._lifecycle_nodes()}

    def command_type(self) -> str:
        """Return the type of velocity commands: Twist or TwistStamped."""
        return next(publisher.type for publisher in self._graph.publishers_of(self._graph.names(COMMAND)))

    def _command_problems(self) -> List[str]:
        """Return a problem if no node publishes velocity commands, or nodes publish them with wrong or mixed types."""
        name = self._graph.names(COMMAND)
        publishers = self._graph.publishers_of(name)
        if not publishers:
            others = self._on_other_topics((TWIST_TYPE, TWIST_STAMPED_TYPE), self._graph.publishers_of)
            hints = [
                f"; {publisher.node} publishes {topic} ({publisher.type}): --remap {COMMAND}:={topic}"
                for topic, publisher in others
            ]
            return [f"no node publishes {name} ({TWIST_TYPE} or {TWIST_STAMPED_TYPE}){''.join(hints[:2])}"]
        wrong = [publisher for publisher in publishers if publisher.type not in (TWIST_TYPE, TWIST_STAMPED_TYPE)]
        if wrong:
            return [
                f"{publisher.node} publishes {name} as {publisher.type}, not {TWIST_TYPE} or {TWIST_STAMPED_TYPE}"
                for publisher in wrong
            ]
        if len({publisher.type for publisher in publishers}) > 1:
            listed = ", ".join(f"{publisher.node} ({publisher.type})" for publisher in publishers)
            return [f"{name} is published both as Twist and as TwistStamped: {listed}"]
        return []

    def _incompatible_subscribers(self, topic: Topic) -> List[str]:
        """Return a problem for each subscriber with an incompatible type or QoS profile, which receives nothing."""
        name, found = self._graph.names(topic.name), []
        for subscriber in self._graph.subscribers_of(name):
            if subscriber.type != topic.type:
                found.append(
                    f"{subscriber.node} subscribes to {name} as {subscriber.type}; simscen publishes {topic.type}"
                )
                continue
            publisher = self._graph.publishers.get(topic.name)
            if publisher is not None:
                for policy, offered, requested in incompatible_policies(publisher.qos_profile, subscriber.qos):
                    reason = f"it requests {policy} {requested}, simscen offers {offered}"
                    found.append(f"{subscriber.node} receives nothing on {name}: {reason}")
        return found

    def _other_publishers(self, topic: Topic) -> List[str]:
        """Return a problem for each other node that publishes a topic of simscen."""
        if topic.name in SHARED_TOPICS:
            return []
        name = self._graph.names(topic.name)
        return [
            f"{publisher.node} publishes {name} as well: do not start that node, or use --without {topic.name}"
            for publisher in self._graph.publishers_of(name)
        ]

    def _unused_sensors(self) -> List[str]:
        """Return a problem for each sensor without a subscriber if a node waits for its type on another topic.

        Otherwise, return a problem if no sensor has a subscriber.
        """
        found = []
        sensors = [topic for topic in self._topics if topic.type.startswith(("sensor_msgs/", ODOMETRY_TYPE))]
        for topic in sensors:
            name = self._graph.names(topic.name)
            if self._graph.subscribers_of(name):
                continue
            for other, subscriber in self._on_other_topics((topic.type,), self._graph.subscribers_of):
                if not self._graph.node.get_publishers_info_by_topic(other):
                    found.append(
                        f"no node subscribes to {name}; {subscriber.node} waits for {other} ({subscriber.type}), "
                        f"which no node publishes: --remap {topic.name}:={other}"
                    )
        names = [self._graph.names(topic.name) for topic in sensors]
        if names and not found and not any(self._graph.subscribers_of(name) for name in names):
            found.append(f"no node subscribes to any sensor: {', '.join(names)}")
        return found

    def _on_other_topics(self, types: Iterable[str], endpoints_of: Any) -> List[Tuple[str, Endpoint]]:
        """Return pairs (topic, endpoint) for endpoints of these types on topics that simscen does not use."""
        used_names = {self._graph.names(topic.name) for topic in self._topics} | {self._graph.names(COMMAND)}
        found = []
        for name, existing in sorted(self._graph.node.get_topic_names_and_types()):
            if name not in used_names and set(existing) & set(types):
                found += [(name, endpoint) for endpoint in endpoints_of(name) if endpoint.type in types]
        return found

    def _nodes_on_wall_time(self) -> List[str]:
        """Return a problem for each node without use_sim_time; none with `--wall-time`."""
        if self._options.wall_time:
            return []
        return [
            f"{node} uses wall time: start it with use_sim_time true (--ros-args -p use_sim_time:=true)"
            for node, sim_time in sorted(self._barrier.sim_time.items())
            if not sim_time
        ]

    def _lifecycle_nodes(self) -> List[Tuple[str, str]]:
        return [node for node in self._graph.nodes() if self._graph.service_type(node, "get_state") == STATE_SERVICE]

    def _inactive_nodes(self) -> List[str]:
        """Return a problem for each lifecycle node that is not active or does not report its state."""
        if self._states is None:
            return []
        self._states.track(self._lifecycle_nodes())
        self._states.ask(POLL_S)
        found = []
        for node in sorted(self._states.clients):
            answer = self._states.answers.get(node)
            if answer is None:
                found.append(f"the lifecycle node {full_name(node)} does not report its state")
            elif answer.current_state.id != ACTIVE:
                found.append(f"the lifecycle node {full_name(node)} is {answer.current_state.label}, not active")
        return found
