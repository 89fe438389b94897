"""Checks of Nav2 before a run: nodes that do not exist, and parameters that do not match what simscen publishes."""

from typing import Any, Dict, List, Optional, Sequence

from simscen.ros2.graph import Graph, Topic, full_name
from simscen.ros2.messages import ODOMETRY, SCAN
from simscen.ros2.nav2 import parameters
from simscen.ros2.node_barrier import NodeBarrier
from simscen.ros2.node_parameters import NodeParameters
from simscen.ros2.options import Options
from simscen.ros2.user_transforms import UserTransforms


class Nav2Readiness:
    """Checks the nodes of a running Nav2 and their parameters, and the parameter file if there is one."""

    def __init__(
        self, graph: Graph, barrier: NodeBarrier, topics: Sequence[Topic], options: Options, bases: Sequence[str]
    ) -> None:
        self._graph, self._options = graph, options
        self._known = NodeParameters(graph, barrier)
        self.user_transforms: Optional[UserTransforms] = None
        odometry = [graph.names(topic.name) for topic in topics if topic.type == ODOMETRY]
        self._offer = parameters.Offer(
            [graph.names(topic.name) for topic in topics if topic.type == SCAN],
            odometry[0] if odometry else "",
            bases,
            graph.names.namespace,
        )

    def _offered(self) -> parameters.Offer:
        """Return what simscen and the user's transforms offer to Nav2."""
        if self.user_transforms is None:
            return self._offer
        return self._offer._replace(bases=[*self._offer.bases, *self.user_transforms.robot_frames])

    def missing_nodes(self) -> List[str]:
        """Return the problems of the parameter file, and Nav2's nodes that do not exist."""
        found = self._findings(self._options.parameters or {}, {}, f"{self._options.parameter_file}: ")
        names = {name for name, _ in self._graph.nodes()}
        for name in parameters.NODES:
            # Another localizer may publish map -> odom.
            localized = name == "amcl" and self._graph.publishers_of(self._graph.names("/tf"))
            if name not in names and not localized:
                found.append(f"there is no node {name}")
        return found

    def wrong_parameters(self) -> List[str]:
        """Return parameters of the running nodes that do not match what simscen publishes."""
        nodes = [node for node in self._graph.nodes() if node[0] in parameters.RULES]
        values = {node[0]: self._parameters(full_name(node), node[0]) for node in nodes}
        return self._findings(values, {node[0]: self._graph.subscribed_topics(node) for node in nodes}, "")

    def _findings(
        self, nodes: Dict[str, Dict[str, Any]], subscriptions: parameters.Subscriptions, prefix: str
    ) -> List[str]:
        found = parameters.check(nodes, self._offered(), subscriptions)
        return [f"{prefix}{finding.node}: {finding.message}" for finding in found if finding.severe]

    def _parameters(self, path: str, name: str) -> Dict[str, Any]:
        """Return the parameters of a node that the rules use; none if it does not answer."""
        names = parameters.relevant_parameters(name, self._known.names(path))
        return self._known.values(path, names)
