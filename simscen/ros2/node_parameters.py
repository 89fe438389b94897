"""Reader of the parameters of other nodes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Sequence

from simscen.ros2.messages import find_type

if TYPE_CHECKING:
    from simscen.ros2.graph import Graph
    from simscen.ros2.node_barrier import NodeBarrier

FIELDS = ("bool", "integer", "double", "string", "byte_array", "bool_array", "integer_array", "double_array")
"""Prefixes of the fields of rcl_interfaces/msg/ParameterValue, in the order of ParameterType from PARAMETER_BOOL on."""
STRING_ARRAY = 9
"""ParameterType.PARAMETER_STRING_ARRAY."""


class NodeParameters:
    """Reads parameters of nodes by their parameter services. Results are empty if a node does not answer in time."""

    def __init__(self, graph: Graph, barrier: NodeBarrier) -> None:
        self._graph, self._barrier = graph, barrier

    def names(self, node: str) -> list[str]:
        """Return the names of all parameters of a node, sorted. `node` is the full name of the node."""
        answer = self._call(node, "ListParameters", "list_parameters")
        return [] if answer is None else sorted(answer.result.names)

    def values(self, node: str, names: Sequence[str]) -> dict[str, Any]:
        """Return the values of the parameters `names` of a node as JSON values. `node` is the full name of the node."""
        answer = self._call(node, "GetParameters", "get_parameters", names=list(names)) if names else None
        return {} if answer is None else dict(zip(names, map(plain_value, answer.values)))

    def _call(self, node: str, service: str, name: str, **request: Any) -> Any:
        service_type: Any = find_type(f"rcl_interfaces/srv/{service}")
        client = self._graph.node.create_client(service_type, f"{node}/{name}")
        try:
            return self._barrier.call(client, service_type.Request(**request))
        finally:
            self._graph.node.destroy_client(client)


def plain_value(value: Any) -> Any:
    """Return an rcl_interfaces/msg/ParameterValue as a JSON value: text for nan and inf, None if it is not set."""
    if value.type == 0:
        return None
    field = "string_array" if value.type == STRING_ARRAY else FIELDS[value.type - 1]
    found = getattr(value, f"{field}_value")
    if isinstance(found, (bool, int, str)):
        return found
    if isinstance(found, float):
        return found if math.isfinite(found) else str(found)
    return [number[0] if isinstance(number, bytes) else number for number in found]
