"""What a log of another robot must hold for temporal criteria and metrics."""

import pytest

from simscen.core.evidence import Coverage, Evidence
from simscen.core.verdict import Status
from simscen.criteria.criterion import AnyCriterion
from simscen.criteria.signal_table import SIGNALS, evidence
from simscen.judge.judge import judge
from simscen.judge.measure.metrics import measure
from simscen.judge.measure.table import METRICS
from simscen.judge.needs import known, needs
from simscen.testing.sketch import sketch, sketch_case

DRIVE = {"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]]}


@pytest.mark.parametrize("name", SIGNALS)
def test_every_signal_says_what_it_needs_and_the_truth_is_its_clock(name):
    assert Evidence.TRUTH in evidence(name)


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
    assert wanted in needs(entry)
    assert needs(entry) != frozenset(Evidence)
    (verdict,) = judge([entry], sketch(DRIVE), sketch_case({}), Coverage({wanted: "no such topic"}))
    assert verdict.status is Status.INCONCLUSIVE
    assert wanted.value in verdict.findings[0].measured


@pytest.mark.parametrize("lacking", Evidence)
def test_a_metric_that_the_log_cannot_tell_is_none_and_says_so(lacking):
    measures = known(measure(sketch(DRIVE), sketch_case({})), Coverage({lacking: "no such topic"}))
    assert list(measures.values) == list(METRICS)
    assert {name for name, value in measures.values.items() if value is None} == set(measures.undefined)
    if lacking is Evidence.CONTACTS:
        assert measures.undefined["collisions"] == measures.undefined["spl"] == f"the log does not say {lacking.value}"
    assert measures.values["path_length"] is None or lacking is not Evidence.TRUTH
