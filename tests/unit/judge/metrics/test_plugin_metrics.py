"""Tests of metrics of installed packages, and of the limits of the zones around people."""

import math
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from simscen.core.records.trace import Trace
from simscen.core.records.verdict import COMPLETE_COVERAGE, Evidence, LogCoverage
from simscen.criteria.base import AnyMeasure
from simscen.criteria.findings import InvalidTrace, MissingEvidence
from simscen.judge.metrics import compute
from simscen.judge.metrics.compute import PERSON_SPACES, MetricValues, add_plugin_metrics, person_metrics
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

TRACE = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]]})
CASE = synthetic_case({})
BEFORE = MetricValues({"spl": 1.0}, {"ldlj": "no motion"})


class PluginMetric:
    """Plug-in metric that returns or raises the given answer."""

    kind, plugin_suffix = "mine", " (my-package 1.0)"

    def __init__(self, answer: object, evidence: frozenset[Evidence] | None = frozenset()) -> None:
        self.answer, self.evidence = answer, evidence

    @property
    def measure(self) -> Any:
        outer = self

        class Measure:
            evidence = outer.evidence

            @staticmethod
            def measure(trace: object, case: object) -> object:
                assert (trace, case) == (TRACE, CASE)
                if isinstance(outer.answer, Exception):
                    raise outer.answer
                return outer.answer

        return Measure


def add(metric: PluginMetric, coverage: LogCoverage = COMPLETE_COVERAGE) -> MetricValues:
    return add_plugin_metrics(BEFORE, [cast("AnyMeasure", metric)], TRACE, CASE, coverage)


@pytest.mark.parametrize("number", [2, 2.5, -1.0, 0.0])
def test_a_number_is_added(number: float) -> None:
    assert add(PluginMetric(number)) == MetricValues({"spl": 1.0, "mine": float(number)}, {"ldlj": "no motion"})


@pytest.mark.parametrize("answer", ["nothing to measure", MissingEvidence("nothing to measure")])
def test_reason_is_added_instead_of_a_number(answer: object) -> None:
    found = add(PluginMetric(answer))
    assert found.values == {"spl": 1.0, "mine": None}
    assert found.undefined == {"ldlj": "no motion", "mine": "nothing to measure"}


@pytest.mark.parametrize("answer", [True, math.nan, math.inf, -math.inf, None, "", [1.0], 1j])
def test_invalid_metric_makes_the_run_an_error(answer: object) -> None:
    with pytest.raises(InvalidTrace, match=r"metric mine is not a finite number: .*\(my-package 1\.0\)"):
        add(PluginMetric(answer))


def test_exception_in_a_metric_makes_the_run_an_error() -> None:
    with pytest.raises(
        InvalidTrace, match=r"metric mine: KeyError: 'x', at test_plugin_metrics\.py:\d+ \(my-package 1\.0\)"
    ):
        add(PluginMetric(KeyError("x")))


def test_missing_evidence_is_a_reason_if_the_metric_needs_it() -> None:
    coverage = LogCoverage({Evidence.SCANS: "", Evidence.TRUTH: ""})
    reason = "the log lacks the true pose of the robot and the times of the scans"
    assert add(PluginMetric(1.0, None), coverage).undefined["mine"] == reason
    assert add(PluginMetric(1.0, frozenset({Evidence.COMMANDS})), coverage).values["mine"] == 1.0
    only = add(PluginMetric(1.0, frozenset({Evidence.SCANS})), coverage).undefined["mine"]
    assert only == "the log lacks the times of the scans"


def test_evidence_for_a_part_of_the_run_is_not_sufficient() -> None:
    coverage = replace(COMPLETE_COVERAGE, partial={Evidence.TRUTH: "the truth has no sample from 1 s to 3 s"})
    for evidence in (None, frozenset({Evidence.TRUTH})):
        found = add(PluginMetric(1.0, evidence), coverage)
        assert (found.values["mine"], found.undefined["mine"]) == (None, "the truth has no sample from 1 s to 3 s")
    assert add(PluginMetric(1.0, frozenset({Evidence.COMMANDS})), coverage).values["mine"] == 1.0


def zones(monkeypatch: pytest.MonkeyPatch, gaps: list[float], trace: Trace = TRACE) -> dict[str, float | str]:
    whole = np.full(len(trace.truth.ticks), gaps[-1])
    whole[: len(gaps)] = gaps
    monkeypatch.setattr(compute, "pedestrian_gap", lambda *_: whole)
    return dict(person_metrics(trace, CASE))


@pytest.mark.parametrize("zone", PERSON_SPACES)
def test_zone_includes_its_lower_limit_and_excludes_its_upper(monkeypatch: Any, zone: str) -> None:
    low, high = PERSON_SPACES[zone]
    assert zones(monkeypatch, [low])[f"intrusion_{zone}"] == 1.0
    assert zones(monkeypatch, [high])[f"intrusion_{zone}"] == 0.0
    assert zones(monkeypatch, [math.nextafter(high, 0.0)])[f"intrusion_{zone}"] == 1.0


def test_contact_with_a_person_is_zero_distance(monkeypatch: pytest.MonkeyPatch) -> None:
    assert zones(monkeypatch, [0.0])["min_person_distance"] == 0.0
    assert (
        zones(monkeypatch, [math.inf])["min_person_distance"] == "no pedestrian was present at any sample of the truth"
    )


def test_run_of_one_tick_is_entirely_in_a_zone(monkeypatch: pytest.MonkeyPatch) -> None:
    first = TRACE.truth
    short = replace(TRACE, truth=replace(first, ticks=first.ticks[:1], values=first.values[:1]), end=1)
    assert zones(monkeypatch, [0.1], short)["intrusion_intimate"] == 1.0
