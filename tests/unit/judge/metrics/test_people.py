"""Tests of metrics of distances to people, in closed form."""

import pytest

from simscen.judge.metrics.compute import compute_metrics, person_metrics
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

ANNA = [0, "object.spawned", "anna", {"person": True, "size": [0.25, 1.7]}]


def test_approaching_robot_spends_the_computed_time_in_each_zone():
    """The robot drives at 1 m/s from 4.55 m to 0.05 m away and stops: 2.4 m are 24 % of 10 s, and so on."""
    waypoints = [[0, 0, 0], [4.5, 4.5, 0], [10, 4.5, 0]]
    trace = synthetic_trace({"seconds": 10, "truth": waypoints, "objects": {"anna": [[0, 5, 0]]}, "events": [ANNA]})
    found = person_metrics(trace, synthetic_case({"inscribed_radius": 0.2}))
    assert found["min_person_distance"] == pytest.approx(0.05, abs=1e-6)
    assert found["intrusion_social"] == pytest.approx(0.24, abs=0.004)
    assert found["intrusion_personal"] == pytest.approx(0.075, abs=0.004)
    assert found["intrusion_intimate"] == pytest.approx(0.59, abs=0.004)


def test_nearest_present_person_counts():
    bert = [5, "object.spawned", "bert", {"person": True, "size": [0.25, 1.7]}]
    trace = synthetic_trace({"seconds": 10, "truth": [[0, 0, 0]], "objects": {"anna": [[0, 2, 0]], "bert": [[0, 1, 0]]},
                    "events": [ANNA, bert]})  # fmt: skip
    found = person_metrics(trace, synthetic_case({"footprint": [[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]]}))
    assert found["min_person_distance"] == pytest.approx(0.55)
    assert (found["intrusion_social"], found["intrusion_personal"]) == pytest.approx((0.5, 0.5), abs=0.003)


def test_metrics_of_people_are_undefined_without_people():
    found = compute_metrics(synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]}), synthetic_case({}))
    people = ["min_person_distance", "intrusion_intimate", "intrusion_personal", "intrusion_social"]
    assert {found.undefined[name] for name in people} == {"there were no people"}
