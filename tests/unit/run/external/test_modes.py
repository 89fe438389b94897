"""Tests of navigation modes of external stacks."""

import pytest
from stack_programs import DRIVE

from simscen.core.errors import RunError
from simscen.core.records.run_result import Outcome

WITHOUT_MODES = 'peer = Peer("mine", "2.1", topics=["/odom"])\n'
WITH_MODES = WITHOUT_MODES.replace(
    ")\n", ', modes=["navigate_to_pose", "navigate_through_poses", "follow_waypoints"])\n'
)
REACH_AT_ONCE = "for step in peer:\n    if peer.goals.accept(): peer.goals.reached()\n    step.drive(0.0, 0.0)\n"
THREE_GOALS = "[{name: a, pose: {x: 2, y: 1}}, {name: b, pose: {x: 3, y: 1}}, {name: c, pose: {x: 1, y: 1}}]"
TWO_LOOPS = {"navigation": "{mode: navigate_through_poses, loops: 2}", "goals": THREE_GOALS}


def goal_events(run) -> list[tuple[int, str, str]]:
    """Return tick, kind, and name of all events of goals and of the navigation."""
    return [
        (event.tick, str(event.kind), event.name)
        for event in run.trace.events
        if event.kind.split(".")[0] in ("goal", "navigation")
    ]


def ends_of_goals(run) -> list[tuple[str, str]]:
    """Return kind and name of these events without `goal.accepted`."""
    return [(kind, name) for _, kind, name in goal_events(run) if kind != "goal.accepted"]


@pytest.mark.parametrize("mode", ["navigate_through_poses", "follow_waypoints"])
def test_an_unsupported_mode_is_a_protocol_error(play, mode: str) -> None:
    with pytest.raises(RunError) as error:
        play(WITHOUT_MODES + DRIVE, navigation=f"{{mode: {mode}}}")
    assert error.value.kind == "stack-protocol"
    assert f"sends goals by {mode}, which this stack does not support; it supports navigate_to_pose" in str(error.value)


def test_a_stack_without_modes_gets_goals_one_after_the_other(play) -> None:
    older = "import json\n" + WITHOUT_MODES.replace("Peer(", "Older(").replace(
        "peer =",
        "class Older(Peer):\n"
        "    pass\n"
        "send = Connection.send_json\n"
        "Connection.send_json = lambda self, kind, data: send(\n"
        "    self, kind, {key: value for key, value in data.items() if key != 'modes'})\n"
        "peer =",
    )
    assert play(older + DRIVE).result.outcome is Outcome.PASSED
    with pytest.raises(RunError, match="does not support"):
        play(older + DRIVE, navigation="{mode: follow_waypoints}")


def test_via_goals_are_passed_in_each_loop(play) -> None:
    run = play(WITH_MODES + REACH_AT_ONCE, **TWO_LOOPS)
    assert ends_of_goals(run) == [
        ("goal.passed", "a"),
        ("goal.passed", "b"),
        ("goal.reached", "c"),
        ("goal.passed", "a#2"),
        ("goal.passed", "b#2"),
        ("goal.reached", "c#2"),
        ("navigation.ended", "SUCCEEDED"),
    ]
    assert run.result.outcome is Outcome.FAILED  # the robot has not moved
    failed = {f.what for v in run.result.verdicts for f in v.findings if f.status.value == "fail"}
    assert failed == {"goal a", "goal b", "goal a#2", "goal b#2"}


def test_a_failure_ends_all_goals_of_a_loop_and_the_next_loop_follows(play) -> None:
    text = (
        "for step in peer:\n    if peer.goals.accept(): peer.goals.failed(308, go_on=True)\n    step.drive(0.0, 0.0)\n"
    )
    run = play(WITH_MODES + text, on_goal_failure="continue", **TWO_LOOPS)
    assert ends_of_goals(run) == [
        *(("goal.failed", name) for name in ("a", "b", "c", "a#2", "b#2", "c#2")),
        ("navigation.ended", "FAILED"),
    ]
    failed = next(event for event in run.trace.events if event.kind == "goal.failed")
    assert failed.data["error_name"] == "NO_VALID_PATH"


def test_peer_and_engine_wait_after_a_goal_for_its_wait_time(play) -> None:
    goals = (
        "[{name: a, pose: {x: 1, y: 1}, on_reached: {wait: 0.5}}, {name: b, pose: {x: 1, y: 1}, on_reached: {wait: 1}}]"
    )
    run = play(WITH_MODES + REACH_AT_ONCE, goals=goals, navigation="{mode: follow_waypoints}")
    assert goal_events(run) == [
        (0, "goal.accepted", "a"),
        (0, "goal.reached", "a"),
        (120, "goal.accepted", "b"),
        (120, "goal.reached", "b"),
        (360, "navigation.ended", "SUCCEEDED"),
    ]
    assert run.result.outcome is Outcome.PASSED


@pytest.mark.parametrize(
    ("events", "message"),
    [
        ([("goal.accepted", "a"), ("goal.reached", "a"), ("goal.accepted", "b")], "must still wait at its last goal"),
        ([("goal.accepted", "a"), ("goal.passed", "a")], "which is a goal without `via`"),
        ([("goal.passed", "a")], "no goal is active"),
    ],
)
def test_impossible_event_is_an_error(play, events, message: str) -> None:
    lines = "".join(f"    peer.goals.report({kind!r}, {name!r})\n" for kind, name in events)
    goals = "[{name: a, pose: {x: 1, y: 1}, on_reached: {wait: 0.5}}, {name: b, pose: {x: 2, y: 1}}]"
    with pytest.raises(RunError, match=message) as error:
        play(WITH_MODES + "for step in peer:\n" + lines + "    step.drive(0.0, 0.0)\n", goals=goals)
    assert error.value.kind == "stack-protocol"


def test_a_new_goal_cancels_all_poses_of_the_current_loop(play) -> None:
    events = "[{when: {time: 0.5}, do: {new_goal: {name: detour, pose: {x: 1, y: 2}}}}]"
    accept = "for step in peer:\n    goal = peer.goals.accept()\n"
    text = accept + "    if goal and step.seconds > 1: peer.goals.reached()\n    step.drive(0.0, 0.0)\n"
    run = play(WITH_MODES + text, events=events, **TWO_LOOPS)
    assert ends_of_goals(run)[:5] == [
        *(("goal.canceled", name) for name in "abc"),
        ("goal.reached", "detour"),
        ("goal.passed", "a#2"),
    ]
