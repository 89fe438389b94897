"""Coming to rest: how the adapter knows that the nodes have dealt with what it published, without waiting a while.

Every node of rclcpp and rclpy serves its parameters in the executor that also calls its subscriptions and timers, in
this order: timers, subscriptions, services. So a node that answers a request for a parameter has taken, before, the
messages that had reached it when it was asked. What a message sets off in it, a timer that a new time of /clock makes
due, comes before the answer to the next request. A *round* asks all nodes at once and waits for all answers.
"""

from typing import Any, Callable, Dict, List, Tuple

from simscen.ros2 import interfaces
from simscen.ros2.failure import Failure
from simscen.ros2.graph import Graph, full

_TYPE = "rcl_interfaces/srv/GetParameters"


class Rest:
    """Asks the nodes of the graph."""

    def __init__(self, graph: Graph, clock: Callable[[], float], limit: float) -> None:
        self._graph, self._clock, self._limit = graph, clock, limit
        self._service: Any = interfaces.find(_TYPE)
        self._clients: Dict[Tuple[str, str], Any] = {}
        self.silent: List[str] = []
        """Nodes that do not serve their parameters: nobody can know when they have come to rest."""

    @property
    def nodes(self) -> List[str]:
        """The nodes that are asked."""
        return [full(node) for node in sorted(self._clients)]

    def look_round(self) -> None:
        """Find the nodes that there are now."""
        there = self._graph.nodes()
        self.silent = []
        for gone in [node for node in self._clients if node not in there]:
            self._graph.node.destroy_client(self._clients.pop(gone))
        for node in there:
            if self._graph.service(node, "get_parameters") is None:
                self.silent.append(full(node))
            elif node not in self._clients:
                self._clients[node] = self._graph.node.create_client(self._service, f"{full(node)}/get_parameters")

    def ask(self, name: str) -> Dict[str, Any]:
        """Node → its value of a parameter (a ParameterValue), of all nodes that answer."""
        answers = self._round([name])
        return {full(node): values[0] for node, values in answers.items() if values}

    def round(self) -> None:
        """Have every node take what it has been sent. Raises Failure naming the nodes that do not answer."""
        self._round([])

    def wait(self, future: Any, otherwise: str) -> None:
        """Take what comes until `future` is done. Raises Failure saying `otherwise` when that takes too long."""
        if not self._graph.until(future.done, self._limit, self._clock):
            raise Failure(f"{otherwise} for {self._limit:g} s")

    def call(self, client: Any, request: Any) -> Any:
        """The answer of a service; None when it is not there or does not answer."""
        if not self._graph.until(client.service_is_ready, 1.0, self._clock):
            return None
        future = client.call_async(request)
        return future.result() if self._graph.until(future.done, 1.0, self._clock) else None

    def _round(self, names: List[str]) -> Dict[Tuple[str, str], Any]:
        request = self._service.Request(names=names)
        for client in self._clients.values():
            if not self._graph.until(client.service_is_ready, self._limit, self._clock):
                raise Failure(f"the node {self._name(client)} has gone")
        futures = {node: client.call_async(request) for node, client in self._clients.items()}
        if not self._graph.until(lambda: all(f.done() for f in futures.values()), self._limit, self._clock):
            late = ", ".join(full(node) for node in sorted(futures) if not futures[node].done())
            raise Failure(f"{late} has not answered for {self._limit:g} s: it hangs, or was killed")
        self._graph.take_all()
        return {node: future.result().values for node, future in futures.items()}

    def _name(self, client: Any) -> str:
        return next(full(node) for node, mine in self._clients.items() if mine is client)
