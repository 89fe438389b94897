"""Tests of the evidence that signals need in logs of real robots."""

import pytest

from simscen.core.records.verdict import Evidence, LogCoverage, Status
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.trace_signals.catalog import SIGNALS, signal_evidence
from simscen.judge.evaluation import judge, required_evidence
from simscen.judge.metrics.catalog import METRICS
from simscen.judge.metrics.compute import compute_metrics
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

DRIVE = {"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]]}


@pytest.mark.parametrize("name", SIGNALS)
def test_every_signal_states_its_evidence_and_uses_the_clock_of_the_truth(name):
    assert Evidence.TRUTH in signal_evidence(name)


@pytest.mark.parametrize(
    ("criterion", "wanted"),
    [
        ({"always": {"signal": "clearance", "op": ">", "value": 0}}, Evidence.CLEARANCE),
        ({"eventually": {"not": {"signal": "in_collision"}}}, Evidence.CONTACTS),
        ({"until": {"hold": {"signal": "localized"}, "release": {"signal": "goal_active"}}}, Evidence.NAVIGATION),
        ({"whenever": {"signal": "speed", "op": ">", "value": 0}, "then": {"signal": "localized"}}, Evidence.BELIEF),
    ],
)
def test_a_criterion_needs_what_its_signals_need(criterion, wanted):
    entry = AnyCriterion.model_validate(criterion)
    assert wanted in required_evidence(entry)
    assert required_evidence(entry) != frozenset(Evidence)
    (verdict,) = judge([entry], synthetic_trace(DRIVE), synthetic_case({}), LogCoverage({wanted: "no such topic"}))
    assert verdict.status is Status.INCONCLUSIVE
    assert wanted.value in verdict.findings[0].measured


@pytest.mark.parametrize("lacking", Evidence)
def test_metric_without_its_evidence_is_none_with_a_reason(lacking):
    measures = compute_metrics(synthetic_trace(DRIVE), synthetic_case({}), LogCoverage({lacking: "no such topic"}))
    assert list(measures.values) == list(METRICS)
    assert {name for name, value in measures.values.items() if value is None} == set(measures.undefined)
    if lacking is Evidence.CONTACTS:
        assert measures.undefined["collisions"] == measures.undefined["spl"] == f"the log lacks {lacking.value}"
    assert measures.values["path_length"] is None or lacking is not Evidence.TRUTH
