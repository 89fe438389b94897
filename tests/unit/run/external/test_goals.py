"""Tests of goal reports of external stacks against the ground truth."""

import pytest
from stack_programs import DRIVE

from simscen.core.errors import RunError
from simscen.core.records.run_result import Outcome

HELLO = 'peer = Peer("mine", "2.1", topics=["/odom"])\n'
STOP = "    step.drive(0.0, 0.0)\n"
THREE_GOALS = "[{name: a, pose: {x: 2, y: 1}}, {name: b, pose: {x: 3, y: 1}}, {name: c, pose: {x: 4, y: 1}}]"


def goal_events(run) -> list[tuple[str, str]]:
    """Return kind and name of all events of goals and of the navigation."""
    return [
        (str(event.kind), event.name)
        for event in run.trace.events
        if event.kind.split(".")[0] in ("goal", "navigation")
    ]


def test_a_stack_that_reaches_and_reports_its_goal_passes(play) -> None:
    run = play(HELLO + DRIVE)
    assert run.result.outcome is Outcome.PASSED
    assert goal_events(run) == [("goal.accepted", "desk"), ("goal.reached", "desk"), ("navigation.ended", "SUCCEEDED")]
    assert run.result.ended == "navigation ended"
    accepted = next(event for event in run.trace.events if event.kind == "goal.accepted")
    assert accepted.data == {"x": 2.0, "y": 1.0, "yaw": 0.0, "index": 0}


def test_a_stack_that_falsely_reports_its_goal_as_reached_fails(play) -> None:
    run = play(HELLO + "for step in peer:\n    if peer.goals.accept(): peer.goals.reached()\n" + STOP)
    assert goal_events(run)[-1] == ("navigation.ended", "SUCCEEDED")
    assert run.result.outcome is Outcome.FAILED
    run = play(
        HELLO + "for step in peer:\n    if peer.goals.accept(): peer.goals.reached()\n" + STOP,
        **{"pass": "[{no_false_success: {tolerance: 0.5}}]"},
    )
    assert run.result.outcome is Outcome.FAILED


def test_a_goal_that_the_stack_does_not_report_is_not_reached(play) -> None:
    silent = DRIVE.replace("peer.goals.accept()", "True").replace("peer.goals.reached()", "pass")
    run = play(HELLO + silent)
    assert goal_events(run) == []
    assert (run.result.outcome, run.result.ended) == (Outcome.FAILED, "time limit")
    run = play(
        HELLO + silent,
        **{"pass": "[{eventually: {signal: goal_distance, op: '<=', value: 0.3 m}}, {collisions: {max: 0}}]"},
    )
    assert run.result.outcome is Outcome.PASSED  # criteria on the ground truth do not depend on reports of the stack


@pytest.mark.parametrize(
    ("failure", "name", "number"),
    [
        ("'NO_VALID_PATH', 'walled in'", "NO_VALID_PATH", 208),
        ("208", "NO_VALID_PATH", 208),
        ("0", "NONE", 0),
        ("109", "", 109),
        ("None", "NAVIGATE_UNKNOWN", 9000),
    ],
)
def test_a_failure_has_an_error_code_of_nav2(play, failure: str, name: str, number: int) -> None:
    run = play(HELLO + f"for step in peer:\n    if peer.goals.accept(): peer.goals.failed({failure})\n" + STOP)
    failed = next(event for event in run.trace.events if event.kind == "goal.failed")
    assert (failed.data["error_name"], failed.data["error_code"]) == (name, number)
    ended = next(event for event in run.trace.events if event.kind == "navigation.ended")
    assert (ended.name, ended.data["error_code"]) == ("FAILED", number)


def test_on_goal_failure_determines_whether_the_other_goals_follow(play) -> None:
    text = HELLO + "for step in peer:\n    if peer.goals.accept(): peer.goals.failed(208, go_on={})\n" + STOP
    assert goal_events(play(text.format(False), goals=THREE_GOALS))[-1] == ("navigation.ended", "FAILED")
    assert len(goal_events(play(text.format(False), goals=THREE_GOALS))) == 3
    run = play(text.format(True), goals=THREE_GOALS, on_goal_failure="continue")
    assert [name for kind, name in goal_events(run) if kind == "goal.failed"] == ["a", "b", "c"]


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("events", "message"),
    [
        ([("goal.reached", "desk")], "goal.reached `desk`, but no goal is active"),
        ([("goal.accepted", "shelf")], "goal.accepted `shelf`, but the next goal is `desk`"),
        ([("goal.accepted", "desk")] * 2, "goal.accepted, but goal `desk` is active"),
        ([("goal.accepted", ""), ("goal.reached", "shelf")], "goal.reached `shelf`, but the current goal is `desk`"),
        ([("goal.accepted", ""), ("goal.reached", ""), ("goal.accepted", "")], "but there is no next goal"),
        ([("goal.canceled", "desk")], "goal.canceled `desk`, but no goal is active"),
    ],
)
def test_impossible_goal_event_is_an_error(play, events: list[tuple[str, str]], message: str) -> None:
    report = "".join(f"    peer.goals.report({kind!r}, {name!r})\n" for kind, name in events)
    with pytest.raises(RunError) as error:
        play(HELLO + "for step in peer:\n" + report + STOP)
    assert error.value.kind == "stack-protocol"
    assert message in str(error.value)


def test_a_stack_cannot_claim_that_a_goal_was_preempted(play) -> None:
    """Only simscen decides that a goal was preempted, because a preempted goal need not be reached."""
    claim = "    if peer.goals.accept(): peer.goals._end('goal.canceled', preempted_by='desk')\n"
    run = play(HELLO + "for step in peer:\n" + claim + STOP)
    assert goal_events(run)[-1] == ("navigation.ended", "CANCELED")
    assert run.result.outcome is Outcome.FAILED


def test_a_goal_sent_by_an_event_precedes_the_waiting_goals(play) -> None:
    events = "[{when: {time: 0.5}, do: {new_goal: {name: detour, pose: {x: 1, y: 2}}}}]"
    accept = (
        "for step in peer:\n    goal = peer.goals.accept()\n    if goal and step.seconds > 1: peer.goals.reached()\n"
    )
    run = play(HELLO + accept + STOP, goals=THREE_GOALS, events=events)
    assert goal_events(run)[:4] == [
        ("goal.accepted", "a"),
        ("goal.canceled", "a"),
        ("goal.accepted", "detour"),
        ("goal.reached", "detour"),
    ]
    canceled = run.trace.events[next(k for k, e in enumerate(run.trace.events) if e.kind == "goal.canceled")]
    assert canceled.data["preempted_by"] == "detour"
    assert canceled.tick == 120
    assert [name for kind, name in goal_events(run) if kind == "goal.reached"] == ["detour", "b", "c"]


def test_cancellation_of_a_goal_is_logged_immediately(play) -> None:
    events = "[{when: {time: 0.5}, do: {cancel_goal: {}}}]"
    run = play(HELLO + "for step in peer:\n    peer.goals.accept()\n" + STOP, goals=THREE_GOALS, events=events)
    assert goal_events(run) == [("goal.accepted", "a"), ("goal.canceled", "a"), ("navigation.ended", "CANCELED")]
    assert run.trace.events[-2].tick == 120 or run.trace.events[-3].tick == 120


def test_the_timeout_of_a_goal_is_enforced_if_the_stack_ignores_it(play) -> None:
    goals = "[{name: a, pose: {x: 2, y: 1}, timeout: 0.5}, {name: b, pose: {x: 3, y: 1}}]"
    text = HELLO + "for step in peer:\n    peer.goals.accept()\n" + STOP
    run = play(text, goals=goals)
    failed = next(event for event in run.trace.events if event.kind == "goal.failed")
    assert (failed.name, failed.data["error_name"]) == ("a", "NAVIGATE_TIMEOUT")
    assert goal_events(run)[-1] == ("navigation.ended", "FAILED")
    run = play(text, goals=goals, on_goal_failure="continue")
    assert goal_events(run) == [("goal.accepted", "a"), ("goal.failed", "a"), ("goal.accepted", "b")]


def test_replans_and_recoveries_that_a_stack_reports_are_counted(play) -> None:
    report = (
        "    if step.tick == 12:\n"
        "        peer.goals.report('plan.made', 'desk', reason='blocked', length=1.5)\n"
        "        peer.goals.report('recovery.started', 'spin', error_code=208)\n"
        "        peer.goals.report('recovery.ended', 'spin', outcome='done')\n"
    )
    text = HELLO + "for step in peer:\n    peer.goals.accept()\n" + report + STOP
    run = play(text, **{"pass": "[{replans: {min: 1, max: 1}}, {recoveries: {min: 1, max: 1, name: spin}}]"})
    assert run.result.outcome is Outcome.PASSED, run.result.verdicts


def test_log_contains_name_and_version_of_the_stack(play, tmp_path) -> None:
    from mcap.reader import make_reader

    play(HELLO.replace('"2.1"', '"2.1", about={"sync": "lockstep"}') + "peer.add(beats=7)\n" + DRIVE)
    with (tmp_path / "run.mcap").open("rb") as stream:
        records = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}
    assert records["simscen.stack"] == {
        "external": "mine",
        "name": "mine",
        "version": "2.1",
        "protocol": "1",
        "about": '{"beats": 7, "sync": "lockstep"}',
    }


def test_log_lines_of_the_stack_are_in_rosout(play, tmp_path) -> None:
    from mcap.reader import make_reader

    play(HELLO + "for step in peer:\n    if step.tick == 24: step.log('a wall', 30)\n" + STOP, time_limit="0.3")
    with (tmp_path / "run.mcap").open("rb") as stream:
        messages = [message for _, _, message in make_reader(stream).iter_messages(["/rosout"])]
    assert any(b"a wall\0" in message.data and message.log_time == 100_000_000 for message in messages)
