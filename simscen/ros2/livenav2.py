"""Whether a running Nav2 fits: its nodes are there, and their parameters say what simscen publishes."""

from typing import Any, Dict, List, Sequence

from simscen.ros2 import interfaces, nav2
from simscen.ros2.graph import Graph, Topic, full
from simscen.ros2.options import Options
from simscen.ros2.rest import Rest

SCAN, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"


class LiveNav2:
    """Looks at Nav2's nodes, and at the parameter file if the user named it."""

    def __init__(self, graph: Graph, rest: Rest, given: Sequence[Topic], options: Options) -> None:
        self._graph, self._rest, self._options = graph, rest, options
        names = graph.names
        odometry = [names(topic.name) for topic in given if topic.type == ODOMETRY]
        self._offer = nav2.Offer(
            [names(topic.name) for topic in given if topic.type == SCAN],
            odometry[0] if odometry else "",
            list(dict.fromkeys(("base_link", options.base_frame or "base_link"))),
        )

    def missing(self) -> List[str]:
        """What of Nav2 is missing or does not fit, one sentence each."""
        found = self._findings(self._options.parameters or {}, f"{self._options.parameter_file}: ")
        there = {name: full((name, space)) for name, space in self._graph.nodes()}
        for name in nav2.NODES:
            if name == "amcl" and self._somebody_else_localizes():
                continue
            if name not in there:
                found.append(f"there is no node {name}")
        if found:
            return found
        parameters = {name: self._parameters(path, name) for name, path in there.items() if name in nav2.RULES}
        return self._findings(parameters, "")

    def _findings(self, nodes: Dict[str, Dict[str, Any]], prefix: str) -> List[str]:
        found = nav2.check(nodes, self._offer)
        return [f"{prefix}{finding.node}: {finding.message}" for finding in found if finding.severe]

    def _somebody_else_localizes(self) -> bool:
        return bool(self._graph.publishers(self._graph.names("/tf")))

    def _parameters(self, path: str, name: str) -> Dict[str, Any]:
        """The parameters of a node that the rules look at; none where it does not serve them."""
        listing: Any = interfaces.find("rcl_interfaces/srv/ListParameters")
        known = self._call(listing, f"{path}/list_parameters", listing.Request())
        if known is None:
            return {}
        names = nav2.wanted(name, known.result.names)
        getting: Any = interfaces.find("rcl_interfaces/srv/GetParameters")
        got = self._call(getting, f"{path}/get_parameters", getting.Request(names=names))
        return {} if got is None else {key: _plain(value) for key, value in zip(names, got.values)}

    def _call(self, kind: Any, name: str, request: Any) -> Any:
        client = self._graph.node.create_client(kind, name)
        try:
            return self._rest.call(client, request)
        finally:
            self._graph.node.destroy_client(client)


def _plain(value: Any) -> Any:
    """What a rcl_interfaces/msg/ParameterValue holds."""
    fields = ("", "bool", "integer", "double", "string", "byte_array", "bool_array", "integer_array", "double_array")
    names = (*fields, "string_array")
    return getattr(value, f"{names[value.type]}_value") if value.type else None
