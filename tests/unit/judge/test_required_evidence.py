"""Tests of the evidence that each criterion and metric needs."""

import pytest

from simscen.core.records.verdict import Evidence, LogCoverage
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import partial_evidence_reason, required_evidence
from simscen.judge.metrics.catalog import METRICS
from simscen.judge.metrics.compute import compute_metrics
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

TRUTH, ALIGNMENT, GOALS, BELIEF = Evidence.TRUTH, Evidence.ALIGNMENT, Evidence.NAVIGATION, Evidence.BELIEF


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ({"goals_reached": {}}, {TRUTH, ALIGNMENT, GOALS}),
        ({"result": {"status": "FAILED"}}, {GOALS}),
        ({"result": {"status": "FAILED", "error_code": "NO_VALID_PATH"}}, {GOALS, Evidence.ERROR_CODES}),
        ({"error_code": {"code": "NO_VALID_PATH"}}, {GOALS, Evidence.ERROR_CODES}),
        ({"no_false_success": {}}, {TRUTH, ALIGNMENT, GOALS}),
        ({"collisions": {}}, {Evidence.CONTACTS}),
        ({"collisions": {"people": True}}, {Evidence.CONTACTS, Evidence.OBJECTS}),
        ({"collisions": {"caused_by_robot": True}}, {Evidence.CONTACTS, TRUTH, Evidence.VELOCITY}),
        ({"clearance": {"min": 0.1}}, {Evidence.CLEARANCE}),
        ({"keepout": {"region": "ramp"}}, {TRUTH, ALIGNMENT, Evidence.FOOTPRINT}),
        (
            {"keepout": {"region": "ramp", "while_on": True}},
            {TRUTH, ALIGNMENT, Evidence.FOOTPRINT, Evidence.DISTURBANCES},
        ),
        ({"time_to_goal": {"max": 9}}, {GOALS}),
        ({"path_length": {"max": 9}}, {TRUTH}),
        ({"speed": {"max": 1}}, {TRUTH, Evidence.VELOCITY}),
        ({"speed": {"max": 1, "in": "ramp"}}, {TRUTH, Evidence.VELOCITY, ALIGNMENT}),
        ({"speed": {"mask": {"file": "a.yaml", "type": "absolute"}}}, {TRUTH, Evidence.VELOCITY, ALIGNMENT}),
        (
            {"speed": {"max": 1, "in": "ramp", "while_on": True}},
            {TRUTH, Evidence.VELOCITY, ALIGNMENT, Evidence.DISTURBANCES},
        ),
        ({"stopped_within": {"time": 1, "after": "lidar.off"}}, {TRUTH, Evidence.VELOCITY, Evidence.DISTURBANCES}),
        ({"stuck": {}}, {TRUTH, GOALS}),
        ({"localization_error": {"max": 1, "after": 2}}, {TRUTH, ALIGNMENT, BELIEF}),
        ({"localization_consistency": {"every": 5}}, {TRUTH, ALIGNMENT, BELIEF, Evidence.COVARIANCE}),
        ({"relocalized_within": {"time": 9}}, {TRUTH, ALIGNMENT, BELIEF}),
        ({"relocalized_within": {"time": 9, "after": "gust"}}, {TRUTH, ALIGNMENT, BELIEF, Evidence.DISTURBANCES}),
        ({"personal_space": {}}, {TRUTH, ALIGNMENT, Evidence.OBJECTS, Evidence.FOOTPRINT}),
        (
            {"personal_space": {"while_driving": True}},
            {TRUTH, ALIGNMENT, Evidence.OBJECTS, Evidence.FOOTPRINT, Evidence.VELOCITY},
        ),
        ({"replans": {"max": 2}}, {Evidence.PLANNING}),
        ({"recoveries": {"max": 2}}, {Evidence.RECOVERIES}),
    ],
)
def test_criterion_needs_exactly_this_evidence(words, wanted):
    assert required_evidence(AnyCriterion.model_validate(words)) == wanted


NEAR_PEOPLE = {"min_person_distance", "intrusion_intimate", "intrusion_personal", "intrusion_social"}


@pytest.mark.parametrize(
    ("lacking", "left_out"),
    [
        (GOALS, {"success", "spl", "barn_score", "soft_spl", "path_irregularity", "time_to_goal"}),
        (Evidence.CONTACTS, {"success", "spl", "barn_score", "collisions", "contact_time"}),
        (
            ALIGNMENT,
            {
                "success",
                "spl",
                "barn_score",
                "soft_spl",
                "nees",
                *NEAR_PEOPLE,
                *(name for name in METRICS if "ape" in name),
            },
        ),
        (Evidence.OBJECTS, NEAR_PEOPLE),
        (BELIEF, {"nees", *(name for name in METRICS if "pe_" in name)}),
        (Evidence.COVARIANCE, {"nees"}),
        (Evidence.CLEARANCE, {"min_clearance", "mean_clearance"}),
        (Evidence.PLANNING, {"replans", "path_irregularity"}),
        (Evidence.RECOVERIES, {"recoveries"}),
        (Evidence.VELOCITY, {"max_speed", "time_not_moving", "mean_jerk", "max_jerk", "sparc", "ldlj"}),
    ],
)
def test_missing_evidence_removes_exactly_these_metrics(lacking, left_out):
    trace = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]], "clearance": 0.5})
    whole = compute_metrics(trace, synthetic_case({}))
    for coverage in (LogCoverage({lacking: ""}), LogCoverage(partial={lacking: "not after t = 1 s"})):
        found = compute_metrics(trace, synthetic_case({}), coverage)
        reasons = {f"the log lacks {lacking.value}", "not after t = 1 s"}
        assert {name for name, reason in found.undefined.items() if reason in reasons} == left_out
        assert all(found.values[name] is None for name in left_out)
        assert all(found.values[name] == whole.values[name] for name in METRICS if name not in left_out)


def test_only_gaps_in_needed_evidence_prevent_a_pass():
    gaps = LogCoverage(partial={Evidence.CONTACTS: "no contacts before t = 3 s", BELIEF: "no belief after t = 9 s"})
    assert partial_evidence_reason({Evidence.CONTACTS}, gaps) == "no contacts before t = 3 s"
    assert partial_evidence_reason({Evidence.CLEARANCE}, gaps) == ""
