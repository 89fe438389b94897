"""Whether the graph is what a run needs, and in words what is missing."""

from typing import Any, Iterable, List, Sequence, Tuple

from simscen.ros2 import interfaces, quality
from simscen.ros2.goals import Doors
from simscen.ros2.graph import End, Graph, Topic, full
from simscen.ros2.livenav2 import LiveNav2
from simscen.ros2.options import Options
from simscen.ros2.rest import Rest

COMMAND = "/cmd_vel"
TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
ACTIVE = 3
"""lifecycle_msgs/msg/State.PRIMARY_STATE_ACTIVE."""


SHARED = ("/tf", "/tf_static", "/initialpose", "/goal_pose")
"""Topics that several nodes may publish."""


class Readiness:
    """Looks at the graph again and again until nothing is missing.

    `sensors` are the topics of which one at least must be heard. `wall_time` allows nodes that do not use sim time.
    """

    def __init__(self, graph: Graph, rest: Rest, given: Sequence[Topic], doors: Doors, options: Options) -> None:
        self._graph, self._rest, self._given, self._doors = graph, rest, list(given), doors
        self._options = options
        self._nav2 = LiveNav2(graph, rest, given, options)

    def nobody(self) -> List[str]:
        """What is missing as long as there is no node at all."""
        return [] if self._graph.nodes() else ["there is no other node in this ROS domain"]

    def missing(self) -> List[str]:
        """What is missing now, one sentence each."""
        self._rest.look_round()
        if self.nobody():
            return self.nobody()
        found = self._commands() + self._doors.missing()
        for topic in self._given:
            found += self._heard(topic) + self._also_published(topic)
        found += self._unheard()
        if not found and self._options.nav2:
            found += self._nav2.missing()
        if not found:
            found += self._simulated_time() + self._lifecycles()
        return found

    def command_type(self) -> str:
        """Twist or TwistStamped, as the stack publishes it."""
        return next(end.type for end in self._graph.publishers(self._graph.names(COMMAND)))

    def _commands(self) -> List[str]:
        name = self._graph.names(COMMAND)
        ends = self._graph.publishers(name)
        types = sorted({end.type for end in ends})
        if not ends:
            others = self._elsewhere((TWIST, TWIST_STAMPED), self._graph.publishers)
            hints = [
                f"; {end.node} publishes {topic} ({end.type}): --remap {COMMAND}:={topic}" for topic, end in others
            ]
            return [f"nobody publishes {name} ({TWIST} or {TWIST_STAMPED}){''.join(hints[:2])}"]
        wrong = [end for end in ends if end.type not in (TWIST, TWIST_STAMPED)]
        if wrong:
            return [f"{end.node} publishes {name} as {end.type}, not {TWIST} or {TWIST_STAMPED}" for end in wrong]
        if len(types) > 1:
            return [f"{name} is published both as Twist and as TwistStamped: {_listed(ends)}"]
        return []

    def _heard(self, topic: Topic) -> List[str]:
        """What keeps those from hearing who subscribe to a topic of ours."""
        name, found = self._graph.names(topic.name), []
        for end in self._graph.subscribers(name):
            if end.type != topic.type:
                found.append(f"{end.node} subscribes to {name} as {end.type}; it is {topic.type}")
                continue
            publisher = self._graph.offered.get(topic.name)
            if publisher is not None:
                for policy, offer, wanted in quality.misfits(publisher.qos_profile, end.quality):
                    found.append(f"{end.node} hears nothing of {name}: it asks for {policy} {wanted}, which is {offer}")
        return found

    def _also_published(self, topic: Topic) -> List[str]:
        """Others who publish what only simscen should."""
        if topic.name in SHARED:
            return []
        name = self._graph.names(topic.name)
        return [
            f"{end.node} publishes {name}, too: leave that node out, or tell simscen to: --without {topic.name}"
            for end in self._graph.publishers(name)
        ]

    def _unheard(self) -> List[str]:
        """Sensors that nobody hears while somebody waits for one of that type under another name."""
        found = []
        sensors = [topic for topic in self._given if topic.type.startswith(("sensor_msgs/", "nav_msgs/msg/Odometry"))]
        for topic in sensors:
            name = self._graph.names(topic.name)
            if self._graph.subscribers(name):
                continue
            for other, end in self._elsewhere((topic.type,), self._graph.subscribers):
                if not self._graph.node.get_publishers_info_by_topic(other):
                    found.append(
                        f"nobody subscribes to {name}; {end.node} waits for {other} ({end.type}), which nobody "
                        f"publishes: --remap {topic.name}:={other}"
                    )
        names = [self._graph.names(topic.name) for topic in sensors]
        if names and not found and not any(self._graph.subscribers(name) for name in names):
            found.append(f"nobody subscribes to any sensor: {', '.join(names)}")
        return found

    def _elsewhere(self, types: Iterable[str], ends_of: Any) -> List[Tuple[str, End]]:
        """Ends of these types on topics that are not simscen's."""
        mine = {self._graph.names(topic.name) for topic in self._given} | {self._graph.names(COMMAND)}
        found = []
        for name, there in sorted(self._graph.topics().items()):
            if name not in mine and set(there) & set(types):
                found += [(name, end) for end in ends_of(name) if end.type in types]
        return found

    def _simulated_time(self) -> List[str]:
        if self._options.wall_time:
            return []
        values = self._rest.ask("use_sim_time")
        return [
            f"{node} lives on wall time: start it with use_sim_time true (--ros-args -p use_sim_time:=true)"
            for node, value in sorted(values.items())
            if not value.bool_value
        ]

    def _lifecycles(self) -> List[str]:
        """Lifecycle nodes that are not active."""
        kind: Any = interfaces.find("lifecycle_msgs/srv/GetState")
        found = []
        for node in self._graph.nodes() if kind is not None else ():
            if self._graph.service(node, "get_state") != "lifecycle_msgs/srv/GetState":
                continue
            client = self._graph.node.create_client(kind, f"{full(node)}/get_state")
            try:
                state = self._rest.call(client, kind.Request())
            finally:
                self._graph.node.destroy_client(client)
            if state is None:
                found.append(f"the lifecycle node {full(node)} does not say its state")
            elif state.current_state.id != ACTIVE:
                found.append(f"the lifecycle node {full(node)} is {state.current_state.label}, not active")
        return found


def _listed(ends: Sequence[End]) -> str:
    return ", ".join(f"{end.node} ({end.type})" for end in ends)
