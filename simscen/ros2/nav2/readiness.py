"""Check of a running Nav2 before a run: missing nodes, and parameters that do not match simscen's topics and frames."""

from typing import Any, Dict, List, Optional, Sequence

from simscen.ros2.graph import Graph, Topic, full_name
from simscen.ros2.messages import ODOMETRY_TYPE, SCAN_TYPE
from simscen.ros2.nav2 import parameter_rules
from simscen.ros2.node_barrier import NodeBarrier
from simscen.ros2.node_parameters import NodeParameters
from simscen.ros2.options import Options
from simscen.ros2.user_transforms import UserTransforms


class Nav2Readiness:
    """Checks the nodes of a running Nav2, their parameters, and the parameter file if there is one."""

    def __init__(
        self, graph: Graph, barrier: NodeBarrier, topics: Sequence[Topic], options: Options, base_frames: Sequence[str]
    ) -> None:
        """`topics` are published by simscen. `base_frames` are the names of the base frame in the graph."""
        self._graph, self._options = graph, options
        self._node_parameters = NodeParameters(graph, barrier)
        self.user_transforms: Optional[UserTransforms] = None
        odometry = [graph.names(topic.name) for topic in topics if topic.type == ODOMETRY_TYPE]
        self._names = parameter_rules.PublishedNames(
            [graph.names(topic.name) for topic in topics if topic.type == SCAN_TYPE],
            odometry[0] if odometry else "",
            base_frames,
            graph.names.namespace,
        )

    def node_problems(self) -> List[str]:
        """Return a text for each missing node and each severe problem of the parameter file, except wrong topics."""
        found = self._severe_problems(self._options.parameters or {}, {}, f"{self._options.parameter_file}: ")
        names = {name for name, _ in self._graph.nodes()}
        for name in parameter_rules.REQUIRED_NODES:
            # Another localizer may publish map -> odom.
            is_replaced = name == "amcl" and self._graph.publishers_of(self._graph.names("/tf"))
            if name not in names and not is_replaced:
                found.append(f"there is no node {name}")
        return found

    def wrong_parameters(self) -> List[str]:
        """Return one text for each severe problem of the parameters of the running nodes."""
        nodes = [node for node in self._graph.nodes() if node[0] in parameter_rules.CHECKED_NODES]
        values = {}
        for node in nodes:
            path = full_name(node)
            relevant = parameter_rules.relevant_parameters(node[0], self._node_parameters.names(path))
            values[node[0]] = self._node_parameters.values(path, relevant)
        return self._severe_problems(values, {node[0]: self._graph.subscribed_topics(node) for node in nodes}, "")

    def _severe_problems(
        self, nodes: Dict[str, Dict[str, Any]], subscriptions: parameter_rules.Subscriptions, prefix: str
    ) -> List[str]:
        """Return a text, with `prefix`, for each severe problem of the parameters of `nodes`."""
        names = self._names
        if self.user_transforms is not None:
            names = names._replace(base_frames=[*names.base_frames, *self.user_transforms.robot_frames])
        found = parameter_rules.check(nodes, names, subscriptions)
        return [f"{prefix}{problem.node}: {problem.message}" for problem in found if problem.is_severe]
