"""Property tests of the outcome of a run: expected failures, and the names of verdicts."""

from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import ExpectedFailure, Finding, Status, Verdict
from simscen.criteria.registry import AnyCriterion, verdict_names
from simscen.judge.disturbances import missing_disturbances
from simscen.judge.outcome import apply_expectation, outcome_of_verdicts
from simscen.testing.synthetic_trace import synthetic_trace

PASS, FAIL, INCONCLUSIVE, ERROR = Status.PASS, Status.FAIL, Status.INCONCLUSIVE, Status.ERROR
TRACE = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0, 0]]})
IDS = ["speed", "speed#2", "stuck", "expected", "expected#2", "door"]
"""Names of criteria. Some look like the numbered name of a repeated criterion."""
DISTURBANCES = ["door", "lidar.off", "speed", "expected"]
"""Names of disturbances, some of which are also names of criteria."""


@st.composite
def criteria(draw):
    """Return the verdicts of criteria with random names, which can be equal, and random statuses."""
    ids = draw(st.lists(st.sampled_from([None, *IDS]), min_size=1, max_size=5))
    severities = [draw(st.sampled_from(["fail", "fail", "warn"])) for _ in ids]
    entries = [
        AnyCriterion.model_validate({"speed": {"max": 1}, "severity": severity} | ({"id": name} if name else {}))
        for name, severity in zip(ids, severities, strict=True)
    ]
    statuses = [draw(st.sampled_from([PASS, FAIL, INCONCLUSIVE, PASS, FAIL, ERROR])) for _ in ids]
    return [
        Verdict(entry.kind, name, entry.severity, (Finding(status, name, "1", "2"),))
        for entry, name, status in zip(entries, verdict_names(entries), statuses, strict=True)
    ]


@st.composite
def disturbances(draw, names):
    """Return the outcomes of disturbances with these names."""
    outcomes = []
    for name in draw(names):
        happened = draw(st.booleans())
        disturbance = Disturbance(name, "event", "time: 1", required=draw(st.booleans()))
        outcomes.append(DisturbanceOutcome(disturbance, (240,) if happened else (), happened, "why"))
    return outcomes


def all_verdicts(verdicts, outcomes):
    """Return all verdicts of a run, as judge_run orders them."""
    return [*(verdict for verdict, _ in missing_disturbances(TRACE, outcomes, verdicts)), *verdicts]


@settings(deadline=None)
@given(criteria(), disturbances(st.lists(st.sampled_from(DISTURBANCES), max_size=3)), st.booleans())
def test_each_verdict_of_a_run_has_its_own_name(verdicts, outcomes, is_expected):
    judged = all_verdicts(verdicts, outcomes)
    expected = ExpectedFailure("NAV-1") if is_expected else None
    _, expectation = apply_expectation(expected, judged, outcome_of_verdicts(judged), is_complete=True)
    names = [verdict.id for verdict in [*judged, *([expectation] if expectation else [])]]
    assert len(set(names)) == len(names), names


@settings(deadline=None)
@given(criteria())
def test_run_passes_only_if_all_decisive_criteria_pass(verdicts):
    outcome = outcome_of_verdicts(verdicts)
    decisive = {verdict.status for verdict in verdicts if verdict.severity == "fail"}
    if any(verdict.status is ERROR for verdict in verdicts):
        assert outcome is Outcome.ERROR
    else:
        assert outcome is (Outcome.PASSED if decisive <= {PASS} else Outcome.FAILED)


UNIQUE = st.lists(st.sampled_from(["door", "lidar.off"]), unique=True, max_size=2)


@settings(deadline=None, max_examples=300)
@given(criteria(), disturbances(UNIQUE), st.sets(st.sampled_from(["speed", "stuck", "door", "lidar.off"])))
def test_run_fails_as_expected_only_if_exactly_the_named_entries_fail(verdicts, outcomes, expected_ids):
    """The outcome follows the table in docs/guides/variations.md. Named events and faults must not happen."""
    verdicts = [verdict for verdict in verdicts if verdict.id not in {entry.disturbance.name for entry in outcomes}]
    judged = all_verdicts(verdicts, outcomes)
    before = outcome_of_verdicts(judged)
    outcome, expectation = apply_expectation(
        ExpectedFailure("NAV-1", tuple(sorted(expected_ids))),
        judged,
        before,
        is_complete=True,
        happened={entry.disturbance.name for entry in outcomes if entry.happened},
    )
    criteria_by_status = {
        status: {v.id for v in verdicts if v.status is status and v.severity == "fail"} for status in Status
    }
    missing_names = {entry.disturbance.name for entry in outcomes if entry.missing}
    happened_names = {entry.disturbance.name for entry in outcomes if entry.happened}
    if before is Outcome.ERROR:
        assert outcome is Outcome.ERROR and expectation is None
    elif expected_ids:
        failed, undecided = criteria_by_status[FAIL] | missing_names, criteria_by_status[INCONCLUSIVE]
        is_as_expected = (
            bool(expected_ids & failed)
            and not expected_ids & (criteria_by_status[PASS] | happened_names)
            and not (failed | undecided) - expected_ids
        )
        assert (outcome is Outcome.FAILED_AS_EXPECTED) == is_as_expected
    else:
        assert (outcome is Outcome.FAILED_AS_EXPECTED) == (bool(criteria_by_status[FAIL]) and not missing_names)
    if before is not Outcome.ERROR:
        assert outcome in (Outcome.FAILED, Outcome.FAILED_AS_EXPECTED)
        assert expectation is not None


@st.composite
def sequences(draw):
    """Return the outcomes of the steps of several sequences. A step starts only if the step before has started."""
    outcomes = []
    for number, length in enumerate(draw(st.lists(st.integers(1, 4), max_size=3))):
        started = draw(st.integers(0, length))
        for step in range(length):
            after = len(outcomes) - 1 if step else None
            disturbance = Disturbance(f"{number}.{step}", "event", "time: 1", required=draw(st.booleans()), after=after)
            fired = (240,) if step < started else ()
            outcomes.append(DisturbanceOutcome(disturbance, fired, bool(fired) and draw(st.booleans()), "why"))
    return outcomes


@settings(deadline=None)
@given(sequences())
def test_missing_steps_are_reported_up_to_the_first_that_never_started(outcomes):
    expected, blocked = [], set()
    for entry in outcomes:
        sequence = entry.disturbance.name[0]
        if entry.missing and (entry.fired or sequence not in blocked):
            expected.append(entry.disturbance.name)
        if entry.missing and not entry.fired:
            blocked.add(sequence)
    assert [verdict.id for verdict, _ in missing_disturbances(TRACE, outcomes)] == expected
