"""Tests of the decision which Nav2 server must send a velocity command."""

from types import SimpleNamespace
from typing import Any

import pytest

from simscen.ros2 import node_parameters
from simscen.ros2.nav2.actions import MotionActions, OverdueCommand

MS = 1_000_000


class FakeGraph:
    """Graph with the status topics of actions; `servers` by action, `rates` in Hz by server."""

    def __init__(self, servers: dict[str, str], rates: dict[str, float]) -> None:
        self.servers, self.rates, self.callbacks = servers, rates, dict[str, Any]()
        self.node = SimpleNamespace(
            create_client=lambda _, name: name,
            destroy_client=lambda client: None,
        )

    def subscribe_to_status(self, action: str, keep: Any) -> str | None:
        self.callbacks[action] = keep
        return self.servers.get(action)

    def call(self, client: str, request: Any) -> Any:
        rate = self.rates.get(client.removesuffix("/get_parameters"))
        return None if rate is None else SimpleNamespace(values=[SimpleNamespace(type=3, double_value=rate)])

    def report(self, action: str, *statuses: int) -> None:
        goals = [SimpleNamespace(status=status) for status in statuses]
        self.callbacks[action](SimpleNamespace(status_list=goals))


@pytest.fixture
def types(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_parameters, "find_type", lambda name: SimpleNamespace(Request=lambda **_: None))


@pytest.mark.usefixtures("types")
def test_controller_must_send_a_command_in_each_period_while_it_executes_a_goal() -> None:
    graph = FakeGraph({"follow_path": "/robot1/controller_server"}, {"/robot1/controller_server": 10.0})
    actions = MotionActions(graph, graph)  # type: ignore[arg-type]
    actions.subscribe()
    assert actions.overdue_command(0) is None
    graph.report("follow_path", 4, 2)
    overdue_command = OverdueCommand("/robot1/controller_server", "follow_path")
    assert actions.overdue_command(50 * MS) == overdue_command
    actions.record_command(50 * MS)
    assert actions.overdue_command(100 * MS) is None  # the loop is slower than the control period
    assert actions.overdue_command(150 * MS) == overdue_command
    graph.report("follow_path", 4, 4)
    assert actions.overdue_command(150 * MS) is None


@pytest.mark.usefixtures("types")
def test_server_may_miss_commands_for_one_simulated_second() -> None:
    graph = FakeGraph({"follow_path": "/controller_server"}, {"/controller_server": 20.0})
    actions = MotionActions(graph, graph)  # type: ignore[arg-type]
    actions.subscribe()
    graph.report("follow_path", 2)
    assert actions.wait_s(5.0) == 5.0
    assert actions.record_missing(100 * MS) is None
    assert actions.wait_s(5.0) == 0.25
    assert actions.record_missing(1050 * MS) is None
    assert actions.record_missing(1100 * MS) == OverdueCommand("/controller_server", "follow_path")
    actions.record_command(1150 * MS)
    assert actions.wait_s(5.0) == 5.0
    assert actions.record_missing(1200 * MS) is None


@pytest.mark.usefixtures("types")
def test_missing_command_of_an_ended_action_does_not_count_for_the_next_one() -> None:
    graph = FakeGraph({"follow_path": "/controller_server"}, {"/controller_server": 20.0})
    actions = MotionActions(graph, graph)  # type: ignore[arg-type]
    actions.subscribe()
    graph.report("follow_path", 2)
    assert actions.record_missing(5000 * MS) is None
    graph.report("follow_path", 6)
    graph.report("follow_path", 6, 2)
    assert actions.wait_s(5.0) == 5.0
    assert actions.record_missing(20_000 * MS) is None


@pytest.mark.usefixtures("types")
def test_servers_without_rate_or_status_need_not_send_commands() -> None:
    graph = FakeGraph({"spin": "/behavior_server", "follow_path": "/silent"}, {"/behavior_server": 0.0})
    actions = MotionActions(graph, graph)  # type: ignore[arg-type]
    actions.subscribe()
    graph.report("spin", 2)
    graph.report("follow_path", 2)
    assert actions.overdue_command(0) is None
