"""Tests of the golden verdict cases in tests/cases."""

from pathlib import Path

import pytest
import yaml

from simscen.core.records.verdict import Finding, Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

FILES = sorted((Path(__file__).parents[2] / "cases").glob("*.yaml"))
CASES = [(file.stem, case) for file in FILES for case in yaml.load(file.read_text(encoding="utf-8"), yaml.CSafeLoader)]


@pytest.mark.parametrize(("kind", "golden"), CASES, ids=[f"{kind}: {case['name']}" for kind, case in CASES])
def test_verdict_equals_that_of_the_golden_case(kind, golden):
    entry = AnyCriterion.model_validate(golden["criterion"])
    assert entry.kind == kind
    assert golden["origin"]
    (verdict,) = judge([entry], synthetic_trace(golden["trace"]), synthetic_case(golden.get("case", {})))
    assert verdict.status is Status(golden["expect"]["status"]), verdict
    expected_findings = golden["expect"]["findings"]
    assert len(verdict.findings) == len(expected_findings), verdict.findings
    for finding, expected_finding in zip(verdict.findings, expected_findings, strict=True):
        assert_finding_equals(finding, expected_finding)


def assert_finding_equals(finding: Finding, expected_finding: dict) -> None:
    tolerance = expected_finding.get("tolerance", 1e-6)
    assert finding.status is Status(expected_finding["status"]), finding
    for key in ("what", "measured", "limit"):
        if key in expected_finding:
            assert getattr(finding, key) == expected_finding[key], finding
    for key in ("value", "margin"):
        if key in expected_finding:
            number = expected_finding[key]
            assert getattr(finding, key) == (number if number is None else pytest.approx(number, abs=tolerance)), (
                finding
            )
    if "t" in expected_finding:
        assert finding.tick / 240 == pytest.approx(expected_finding["t"], abs=max(tolerance * 3, 1e-6)), finding
    if "place" in expected_finding:
        assert finding.place == pytest.approx(expected_finding["place"], abs=1e-6), finding
    if "detail" in expected_finding:
        assert list(finding.detail) == expected_finding["detail"], finding


@pytest.mark.parametrize("kind", AnyCriterion.choices())
def test_every_criterion_has_a_passing_and_a_non_passing_golden_case(kind):
    statuses = {case["expect"]["status"] for name, case in CASES if name == kind}
    assert "pass" in statuses
    assert "fail" in statuses
