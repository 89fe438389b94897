"""Tests of the outcomes of events and faults, and of their verdicts."""

import json

import pytest

from simscen.core.records.disturbances import Disturbance
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.disturbances import disturbance_outcomes
from simscen.judge.result_json import from_json, to_json
from simscen.judge.run_result import judge_run
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

DRIVE = {"seconds": 10, "truth": [[0, 0, 0], [10, 5, 0]]}
EVENT = {"name": "pallet falls", "kind": "event", "when": "time: 3 s", "line": 7}
FAULT = {"name": "lidar.off", "kind": "fault", "when": "time: 3 s", "line": 9}


def event(seconds, happened=True, what="spawned pallet", entry=0):
    return [
        [seconds, "event.started", "pallet falls", {"entry": entry}],
        [seconds, "event.ended", "pallet falls", {"entry": entry, "effects": [{"happened": happened, "what": what}]}],
    ]


def fault(start, effect=None, end=None, touched=0, entry=0):
    events = [[start, "fault.started", "lidar.off", {"entry": entry, "sensor": "lidar"}]]
    events += [[effect, "fault.took_effect", "lidar.off", {"entry": entry}]] if effect is not None else []
    events += [[end, "fault.ended", "lidar.off", {"entry": entry, "touched": touched}]] if end is not None else []
    return events


def result_of(events, *disturbances, **changes):
    trace, case = (
        synthetic_trace({**DRIVE, "events": events, **changes}),
        synthetic_case({"disturbances": disturbances}),
    )
    criteria = [AnyCriterion.model_validate({"collisions": {}})]
    return judge_run(RunKey("a", 1), "a.scenario.yaml", criteria, trace, case, lines=(20,))


@pytest.mark.parametrize(
    ("disturbance", "events", "effect"),
    [
        (EVENT, event(3), "spawned pallet"),
        (EVENT, [*event(3, False, "nothing there"), *event(5)], "spawned pallet"),
        (FAULT, fault(3, 3, 5, 20), "disturbed lidar 20 times"),
        (FAULT, fault(3, 3.5, 5, 1), "disturbed lidar once, first at t = 3.50 s"),
        (FAULT, fault(3, 3), "disturbed lidar"),
        (FAULT, [*fault(1, None, 1.1), *fault(3, 3, 5, 20)], "disturbed lidar 20 times, first at t = 3.00 s"),
    ],
)
def test_entry_with_effect_happened(disturbance, events, effect):
    result = result_of(events, disturbance)
    assert result.outcome is Outcome.PASSED
    (outcome,) = result.disturbances
    assert (outcome.happened, outcome.effect) == (True, effect)


@pytest.mark.parametrize(
    ("disturbance", "events", "reason", "tick"),
    [
        (EVENT, [], "it never began; the run ended at t = 10.00 s (navigation ended)", None),
        (EVENT, event(3, False, "there is nothing called pallet"), "there is nothing called pallet", 720),
        (EVENT, event(10), "it began only when the run ended at t = 10.00 s (navigation ended)", 2400),
        (EVENT, event(3, entry=1), "it never began; the run ended at t = 10.00 s (navigation ended)", None),
        (FAULT, [], "it never began; the run ended at t = 10.00 s (navigation ended)", None),
        (FAULT, fault(3, None, 3.05), "it changed no message of lidar from t = 3.00 s to t = 3.05 s", 720),
        (
            FAULT,
            [*fault(3, None, 3.05), *fault(5, None, 5.05)],
            "it changed no message of lidar from t = 3.00 s to t = 3.05 s, the first of 2 times",
            720,
        ),
        (FAULT, fault(3), "it changed no message of lidar from t = 3.00 s on", 720),
        (FAULT, fault(10, 10), "it began only when the run ended at t = 10.00 s (navigation ended)", 2400),
        (FAULT, fault(3, 3, entry=1), "it never began; the run ended at t = 10.00 s (navigation ended)", None),
    ],
)
def test_entry_without_effect_fails_the_run_at_its_line(disturbance, events, reason, tick):
    result = result_of(events, disturbance)
    assert result.outcome is Outcome.FAILED
    verdict, collisions = result.verdicts
    assert (verdict.criterion, verdict.id, verdict.status) == ("disturbance", disturbance["name"], Status.FAIL)
    assert collisions.status is Status.PASS
    assert result.lines == (disturbance["line"], 20)
    (finding,) = verdict.findings
    assert (finding.detail, finding.tick) == ((reason,), tick)
    (data,) = json.loads(to_json(result))["verdicts"][0]["findings"]
    assert data["message"].startswith(f"disturbance did not happen: {disturbance['name']} (when time: 3 s)")
    assert "expected" not in data["message"]


@pytest.mark.parametrize("disturbance", [EVENT, FAULT])
def test_optional_entry_that_did_not_happen_does_not_fail_the_run(disturbance):
    result = result_of([], {**disturbance, "required": False})
    assert result.outcome is Outcome.PASSED
    assert [(outcome.happened, outcome.missing) for outcome in result.disturbances] == [(False, False)]


def test_disturbance_is_undecided_in_a_truncated_log():
    result = result_of([], EVENT, ended=None)
    assert [verdict.status for verdict in result.verdicts] == [Status.INCONCLUSIVE, Status.INCONCLUSIVE]
    assert result.outcome is Outcome.FAILED


def test_every_action_of_an_event_must_take_effect_at_least_once():
    def events_with_effects(first, second):
        effects = [{"happened": happened, "what": what} for happened, what in zip((first, second), "ab", strict=True)]
        return [
            [3, "event.started", "pallet falls", {"entry": 0}],
            [3, "event.ended", "pallet falls", {"entry": 0, "effects": effects}],
        ]

    assert [outcome.happened for outcome in result_of(events_with_effects(True, True), EVENT).disturbances] == [True]
    (outcome,) = result_of(events_with_effects(True, False), EVENT).disturbances
    assert (outcome.happened, outcome.effect) == (False, "b")
    assert [
        outcome.happened
        for outcome in result_of(
            [*events_with_effects(True, False), *events_with_effects(False, True)], EVENT
        ).disturbances
    ] == [True]


def test_entries_with_the_same_name_are_distinguished():
    trace = synthetic_trace({**DRIVE, "events": fault(3, 3, 4, 10, entry=1)})
    case = synthetic_case({"disturbances": [FAULT, EVENT, {**FAULT, "line": 10}]})
    assert [(outcome.disturbance.line, outcome.happened) for outcome in disturbance_outcomes(trace, case)] == [
        (9, False),
        (7, False),
        (10, True),
    ]
    result = result_of([], FAULT, {**FAULT, "line": 10}, {**EVENT, "name": "collisions"})
    assert [verdict.id for verdict in result.verdicts] == ["lidar.off", "lidar.off#2", "collisions#2", "collisions"]


def test_disturbances_are_unchanged_after_writing_and_reading():
    result = result_of([*event(3), *fault(3)], EVENT, {**FAULT, "when": "", "required": False, "after": 0})
    assert from_json(to_json(result)) == result
    assert result.disturbances[1].disturbance == Disturbance("lidar.off", "fault", required=False, line=9, after=0)


def test_disturbance_has_no_line_without_lines_of_criteria():
    trace, case = synthetic_trace(DRIVE), synthetic_case({"disturbances": [EVENT]})
    result = judge_run(RunKey("a", 1), "run.mcap", [AnyCriterion.model_validate({"collisions": {}})], trace, case)
    assert len(result.verdicts) == 2
    assert result.lines == ()


SEQUENCE = [
    {**FAULT, "required": False},
    EVENT,
    {"name": "b", "kind": "event", "when": "then", "line": 8, "after": 0},
    {"name": "c", "kind": "event", "when": "then", "line": 9, "after": 1},
]
NEVER = "it never began; the run ended at t = 10.00 s (navigation ended)"


def test_only_the_first_missing_step_of_a_sequence_is_reported():
    result = result_of([], *SEQUENCE)
    assert [verdict.id for verdict in result.verdicts] == ["pallet falls", "collisions"]
    not_due = f"it was not due, because pallet falls had not happened; {NEVER}"
    assert [outcome.effect for outcome in result.disturbances] == [NEVER, NEVER, not_due, not_due]


def test_step_after_one_without_effect_is_reported_too():
    result = result_of(event(3, False, "nothing there"), *SEQUENCE[:3])
    assert [verdict.id for verdict in result.verdicts] == ["pallet falls", "b", "collisions"]


def test_missing_step_states_when_it_was_due():
    result = result_of([*event(3), *event(5)], *SEQUENCE[:3])
    assert result.disturbances[2].effect == f"it was due from t = 3.00 s, after pallet falls; {NEVER}"


def test_event_without_actions_happens_at_its_first_trigger():
    events = [
        [seconds, kind, "pallet falls", {"entry": 0, "effects": []}]
        for seconds in (3, 5)
        for kind in ("event.started", "event.ended")
    ]
    (outcome,) = result_of(events, EVENT).disturbances
    assert (outcome.happened, outcome.effect, outcome.tick) == (True, "its trigger fired", 720)
