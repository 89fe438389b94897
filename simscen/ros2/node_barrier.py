"""Barrier that waits until all nodes have processed the messages that the adapter published.

In a *round*, the barrier requests a parameter from all nodes at once and waits for all answers. The executor of a node
serves timers, subscriptions, and services in this order. A node that answers has therefore processed all messages that
it received before the request. If a message makes a timer due (/clock), the timer has run after the next round.

Only nodes that answered before the run take part in rounds. These nodes are *in step*. Other nodes are left out, such
as client nodes that Nav2's behavior tree spins only occasionally.
"""

import time
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Set

from simscen.ros2.graph import Graph, Node, full_name
from simscen.ros2.messages import find_type
from simscen.ros2.options import AdapterError
from simscen.ros2.step_time import StepTime

PARAMETER_SERVICE = "rcl_interfaces/srv/GetParameters"
POLL_S = 0.5
"""Maximum wall time that a poll before the run waits for answers."""
MAX_SILENCE_S = 3.0
"""Wall time without an answer after which a node is left out, unless it is required."""
DISAPPEAR_TIMEOUT_S = 1.0
"""Wall time that the service of a node may be missing from the graph before the node counts as exited."""


class _Request(NamedTuple):
    """A pending request.

    future:  future of the answer; None while the service is not available
    start_s: monotonic wall time at which waiting began
    """

    future: Optional[Any]
    start_s: float


class ServicePoll:
    """Calls the same service of several nodes repeatedly. Nodes that do not answer do not block other nodes."""

    def __init__(self, graph: Graph, service_type: str, service: str, **request: Any) -> None:
        self._graph, self._service = graph, service
        self._type: Any = find_type(service_type)
        self._request = request
        self.clients: Dict[Node, Any] = {}
        """Service clients of the tracked nodes."""
        self._pending: Dict[Node, _Request] = {}
        self.answers: Dict[Node, Any] = {}
        """Answers of the nodes that answered during the last `ask`."""

    def track(self, nodes: Iterable[Node]) -> None:
        """Replace the set of nodes to call."""
        tracked = set(nodes)
        for node in [node for node in self.clients if node not in tracked]:
            self.forget(node)
        for node in sorted(tracked - set(self.clients)):
            self.clients[node] = self._graph.node.create_client(self._type, f"{full_name(node)}/{self._service}")

    def forget(self, node: Node) -> None:
        """Stop calling a node."""
        self._graph.node.destroy_client(self.clients.pop(node))
        self._pending.pop(node, None)
        self.answers.pop(node, None)

    def ask(self, timeout_s: float) -> None:
        """Send a request to each node without a pending request, and wait up to `timeout_s` for all answers."""
        for node, client in self.clients.items():
            request = self._pending.get(node, _Request(None, time.monotonic()))
            if request.future is None and client.service_is_ready():
                request = request._replace(future=client.call_async(self._type.Request(**self._request)))
            self._pending[node] = request
            self.answers.pop(node, None)
        self._graph.spin_until(self._collect, timeout_s)

    def _collect(self) -> bool:
        """Store the answers that have arrived. Return whether no request is pending."""
        for node, (future, _) in list(self._pending.items()):
            if future is not None and future.done():
                self.answers[node] = future.result()
                del self._pending[node]
        return not self._pending

    def waiting_s(self, node: Node) -> float:
        """Return for how many seconds of wall time a node has not answered; 0 if it has answered."""
        return time.monotonic() - self._pending[node].start_s if node in self._pending else 0.0


class NodeBarrier:
    """Barrier for all nodes of the graph. Call `poll` before the run, then `begin`, and `round` during the run."""

    def __init__(self, graph: Graph, limit_s: float) -> None:
        """`limit_s` is the maximum wall time for the answers in a round."""
        self._graph, self._limit = graph, limit_s
        self._poll = ServicePoll(graph, PARAMETER_SERVICE, "get_parameters", names=["use_sim_time"])
        self.required_nodes: Callable[[], Set[str]] = set
        """Returns the full names of the nodes without which the run cannot continue."""
        self.without_parameters: List[str] = []
        """Full names of nodes without a parameter service, whose progress the barrier cannot determine."""
        self.silent_nodes: List[str] = []
        """Full names of nodes that do not answer, although they have a parameter service."""
        self.step_time = StepTime(graph.spin_until)

    @property
    def nodes(self) -> List[str]:
        """Full names of the nodes in step, sorted."""
        return [full_name(node) for node in sorted(self._poll.clients) if full_name(node) not in self.silent_nodes]

    @property
    def not_in_step(self) -> List[str]:
        """Full names of the nodes that are left out of rounds, sorted."""
        return sorted([*self.without_parameters, *self.silent_nodes])

    def poll(self) -> List[str]:
        """Send a request to all nodes of the graph. Return a text for each node that has not answered.

        Nodes that are not required are left out after MAX_SILENCE_S without an answer.
        """
        nodes = self._graph.nodes()
        serving = [node for node in nodes if self._graph.service_type(node, "get_parameters") is not None]
        self.without_parameters = [full_name(node) for node in nodes if node not in serving]
        self._poll.track(serving)
        self._poll.ask(POLL_S)
        required, self.silent_nodes, reasons = self.required_nodes(), [], []
        for node in sorted(self._poll.clients):
            name = full_name(node)
            if node in self._poll.answers:
                continue
            if name in required:
                reasons.append(f"{name} does not answer: it is busy, waits for something, or hangs")
            elif self._poll.waiting_s(node) < MAX_SILENCE_S:
                reasons.append(f"{name} has not answered yet")
            else:
                self.silent_nodes.append(name)
        return reasons

    @property
    def sim_time(self) -> Dict[str, bool]:
        """Parameter `use_sim_time` of the nodes that answered the last poll, by full name."""
        answers = self._poll.answers.items()
        return {full_name(node): answer.values[0].bool_value for node, answer in answers if answer.values}

    def begin(self) -> None:
        """Begin the run. All rounds wait for the nodes that answered the last poll."""
        required = self.required_nodes()  # a node that exits later is still required, though the graph forgets it
        self.required_nodes = lambda: required
        for node in [node for node in self._poll.clients if node not in self._poll.answers]:
            self._poll.forget(node)

    def round(self) -> None:
        """Wait until every node in step has processed the messages sent to it.

        Raises AdapterError if a required node does not answer. Other nodes that do not answer are left out of further
        rounds.
        """
        clients = self._poll.clients
        absent = [node for node in clients if not clients[node].service_is_ready()]
        if absent and not self._graph.spin_until(
            lambda: all(clients[node].service_is_ready() for node in absent), DISAPPEAR_TIMEOUT_S
        ):
            self._leave_out([node for node in absent if not clients[node].service_is_ready()], "has exited")
        request = find_type(PARAMETER_SERVICE).Request()  # type: ignore[union-attr]
        futures = {node: client.call_async(request) for node, client in clients.items()}

        def late_nodes() -> List[Node]:
            return [node for node in sorted(futures) if not futures[node].done()]

        if not self.step_time.wait_for(lambda: map(full_name, late_nodes()), limit_s=self._limit):
            self._leave_out(late_nodes(), f"has not answered for {self._limit:g} s: it hangs, or was killed")
        self._graph.receive_all()

    def _leave_out(self, nodes: List[Node], reason: str) -> None:
        """Leave nodes out of further rounds. Raises AdapterError with `reason` if a node is required."""
        required = [full_name(node) for node in nodes if full_name(node) in self.required_nodes()]
        if required:
            raise AdapterError(f"{', '.join(required)} {reason}")
        for node in nodes:
            self._poll.forget(node)
            self.silent_nodes.append(full_name(node))

    def wait(self, future: Any, problem: str) -> None:
        """Wait until `future` is done. Raises AdapterError if that takes too long; `problem` begins the message."""
        limit = min(self._limit, self.step_time.remaining)
        if not self._graph.spin_until(future.done, limit):
            raise AdapterError(f"{problem} for {limit:.3g} s")

    def call(self, client: Any, request: Any) -> Any:
        """Call a service, and return its answer; None if there is no service or no answer within a second."""
        if not self._graph.spin_until(client.service_is_ready, 1.0):
            return None
        future = client.call_async(request)
        return future.result() if self._graph.spin_until(future.done, 1.0) else None
