"""Barrier that waits until all nodes have processed what the adapter published.

Executors of rclcpp and rclpy serve timers, subscriptions and services in this order, and every node serves its
parameters in the executor that also calls its other callbacks. So a node that answers a request for a parameter has
processed the messages that had reached it before. Consequences of such a message, for example a timer that a new
/clock makes due, are processed before the answer to the next request. One *round* asks all nodes at once and waits for
all answers.

Nodes that answered while the run waited to be ready are *in step*. Others are left out of the rounds, for example
client nodes that Nav2's behavior tree spins only occasionally.
"""

import time
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Set

from simscen.ros2.graph import Graph, Node, full_name
from simscen.ros2.messages import find_type
from simscen.ros2.options import AdapterError
from simscen.ros2.step_time import StepTime

PARAMETER_SERVICE = "rcl_interfaces/srv/GetParameters"
POLL_S = 0.5
"""Time to wait for answers of nodes that may be busy."""
SILENT_AFTER_S = 3.0
"""Time without an answer after which a node that is not required is left out."""
DISAPPEAR_TIMEOUT_S = 1.0
"""Time that the service of a node may be missing from the graph."""


class _Request(NamedTuple):
    future: Optional[Any]
    since: float


class ServicePoll:
    """Asks the same service of several nodes without being blocked by nodes that do not answer."""

    def __init__(self, graph: Graph, service_type: str, service: str, **request: Any) -> None:
        self._graph, self._service = graph, service
        self._type: Any = find_type(service_type)
        self._request = request
        self.clients: Dict[Node, Any] = {}
        self._waiting: Dict[Node, _Request] = {}
        self.answers: Dict[Node, Any] = {}
        """The latest answers of the nodes that answered the last request."""

    def track(self, nodes: Iterable[Node]) -> None:
        """Ask exactly these nodes from now on."""
        tracked = set(nodes)
        for node in [node for node in self.clients if node not in tracked]:
            self.forget(node)
        for node in sorted(tracked - set(self.clients)):
            self.clients[node] = self._graph.node.create_client(self._type, f"{full_name(node)}/{self._service}")

    def forget(self, node: Node) -> None:
        """Stop asking a node."""
        self._graph.node.destroy_client(self.clients.pop(node))
        self._waiting.pop(node, None)
        self.answers.pop(node, None)

    def ask(self, timeout_s: float) -> None:
        """Send a request to each node without a pending one, and wait up to `timeout_s` for all answers."""
        for node, client in self.clients.items():
            waiting = self._waiting.get(node, _Request(None, time.monotonic()))
            if waiting.future is None and client.service_is_ready():
                waiting = _Request(client.call_async(self._type.Request(**self._request)), waiting.since)
            self._waiting[node] = waiting
            self.answers.pop(node, None)
        self._graph.spin_until(self._collect, timeout_s)

    def _collect(self) -> bool:
        for node, (future, _) in list(self._waiting.items()):
            if future is not None and future.done():
                self.answers[node] = future.result()
                del self._waiting[node]
        return not self._waiting

    def waiting_s(self, node: Node) -> float:
        """Return for how long a node has not answered."""
        return time.monotonic() - self._waiting[node].since if node in self._waiting else 0.0


class NodeBarrier:
    """Asks the nodes of the graph. `required` returns the full names of nodes without which the run cannot continue."""

    def __init__(self, graph: Graph, limit_s: float) -> None:
        self._graph, self._limit = graph, limit_s
        self._poll = ServicePoll(graph, PARAMETER_SERVICE, "get_parameters", names=["use_sim_time"])
        self.required: Callable[[], Set[str]] = set
        self.without_parameters: List[str] = []
        """Nodes that do not serve their parameters, so that the barrier cannot determine when they have finished."""
        self.left_out: List[str] = []
        """Nodes that do not answer, although they serve their parameters."""
        self.step_time = StepTime(graph.spin_until)

    @property
    def nodes(self) -> List[str]:
        """The nodes that are asked in each round."""
        return [full_name(node) for node in sorted(self._poll.clients) if full_name(node) not in self.left_out]

    @property
    def not_in_step(self) -> List[str]:
        """The nodes that no round waits for."""
        return sorted([*self.without_parameters, *self.left_out])

    def poll(self) -> List[str]:
        """Ask all nodes of the graph; return the reasons why the run must still wait.

        A node that is not required and does not answer for SILENT_AFTER_S is no reason.
        """
        nodes = self._graph.nodes()
        serving = [node for node in nodes if self._graph.service_type(node, "get_parameters") is not None]
        self.without_parameters = [full_name(node) for node in nodes if node not in serving]
        self._poll.track(serving)
        self._poll.ask(POLL_S)
        required, self.left_out, reasons = self.required(), [], []
        for node in sorted(self._poll.clients):
            name = full_name(node)
            if node in self._poll.answers:
                continue
            if name in required:
                reasons.append(f"{name} does not answer: it is busy, waits for something, or hangs")
            elif self._poll.waiting_s(node) < SILENT_AFTER_S:
                reasons.append(f"{name} has not answered yet")
            else:
                self.left_out.append(name)
        return reasons

    @property
    def sim_time(self) -> Dict[str, bool]:
        """Parameter `use_sim_time` of the nodes that answered the last poll."""
        answers = self._poll.answers.items()
        return {full_name(node): answer.values[0].bool_value for node, answer in answers if answer.values}

    def begin(self) -> None:
        """Use the nodes that answered the last poll in all rounds."""
        required = self.required()  # a node that exits later is still required, though the graph forgets it
        self.required = lambda: required
        for node in [node for node in self._poll.clients if node not in self._poll.answers]:
            self._poll.forget(node)

    def round(self) -> None:
        """Wait until every node has processed the messages sent to it.

        Raises AdapterError naming required nodes that do not answer; leaves out others.
        """
        clients = self._poll.clients
        absent = [node for node in clients if not clients[node].service_is_ready()]
        if absent and not self._graph.spin_until(
            lambda: all(clients[node].service_is_ready() for node in absent), DISAPPEAR_TIMEOUT_S
        ):
            self._leave_out([node for node in absent if not clients[node].service_is_ready()], "has exited")
        request = find_type(PARAMETER_SERVICE).Request()  # type: ignore[union-attr]
        futures = {node: client.call_async(request) for node, client in clients.items()}
        if not self.step_time.wait_for(lambda: [full_name(n) for n, f in futures.items() if not f.done()], self._limit):
            late = [node for node in sorted(futures) if not futures[node].done()]
            self._leave_out(late, f"has not answered for {self._limit:g} s: it hangs, or was killed")
        self._graph.take_all()

    def _leave_out(self, nodes: List[Node], reason: str) -> None:
        required = [full_name(node) for node in nodes if full_name(node) in self.required()]
        if required:
            raise AdapterError(f"{', '.join(required)} {reason}")
        for node in nodes:
            self._poll.forget(node)
            self.left_out.append(full_name(node))

    def wait(self, future: Any, otherwise: str) -> None:
        """Wait until `future` is done. Raises AdapterError with `otherwise` when that takes too long."""
        limit = min(self._limit, self.step_time.remaining)
        if not self._graph.spin_until(future.done, limit):
            raise AdapterError(f"{otherwise} for {limit:.3g} s")

    def call(self, client: Any, request: Any) -> Any:
        """Return the answer of a service; None if it is missing or does not answer within a second each."""
        if not self._graph.spin_until(client.service_is_ready, 1.0):
            return None
        future = client.call_async(request)
        return future.result() if self._graph.spin_until(future.done, 1.0) else None
