"""Tests of specifications of criteria: valid values, invalid values, and defaults."""

import pytest
from pydantic import ValidationError

from simscen.criteria.base import Criterion
from simscen.criteria.registry import AnyCriterion


def spec(kind, keys):
    return AnyCriterion.model_validate({kind: keys}).chosen


@pytest.mark.parametrize(
    ("kind", "keys"),
    [
        ("speed", {"max": 1}),
        ("speed", {"max_turn_rate": 1}),
        ("path_length", {"max": 1}),
        ("path_length", {"max_ratio": 1}),
        ("localization_error", {"max": 1}),
        ("localization_error", {"rmse": 1}),
        ("localization_error", {"final": 1}),
        ("localization_error", {"max_yaw": 1}),
        ("replans", {"min": 1}),
        ("replans", {"max": 0}),
        ("replans", {"min": 0, "max": 0}),
        ("replans", {"min": 2, "max": 2}),
        ("recoveries", {"min": 100_000}),
        ("collisions", {"max": 100_000}),
        ("collisions", {"max_impulse": 0}),
        ("goals_reached", {"goals": ["a"] * 1000}),
        ("keepout", {"region": "wet", "distance": 0}),
        ("clearance", {"min": 0}),
    ],
)
def test_each_bound_is_optional(kind, keys):
    assert spec(kind, keys).model_dump(exclude_unset=True) == keys


@pytest.mark.parametrize(
    ("kind", "keys"),
    [
        ("speed", {}),
        ("path_length", {}),
        ("localization_error", {}),
        ("localization_error", {"after": 1}),
        ("replans", {}),
        ("replans", {"min": 0}),
        ("replans", {"min": 3, "max": 2}),
        ("replans", {"reason": "blocked"}),
        ("recoveries", {"min": 100_001}),
        ("recoveries", {"max": -1}),
        ("collisions", {"max": -1}),
        ("collisions", {"max": 100_001}),
        ("collisions", {"max_impulse": -1}),
        ("goals_reached", {"goals": []}),
        ("goals_reached", {"goals": ["a"] * 1001}),
        ("goals_reached", {"tolerance": 0}),
        ("keepout", {"region": "wet", "distance": -1}),
        ("clearance", {"min": -1}),
        ("speed", {"max": 1, "tolerance": 0.05}),
        ("speed", {"max": 1, "in": "wet", "while_on": True, "tolerance": 0.05}),
        ("speed", {"max": 1, "in": "wet", "grace": 1}),
    ],
)
def test_criterion_without_a_valid_bound_is_refused(kind, keys):
    with pytest.raises(ValidationError):
        spec(kind, keys)


@pytest.mark.parametrize(
    ("kind", "keys", "defaults"),
    [
        ("keepout", {"region": "wet"}, {"distance": 0.0}),
        ("no_false_success", {}, {"tolerance": 1.0}),
        ("collisions", {}, {"max": None, "caused_by_robot": False}),
        ("stuck", {}, {"max": 10.0, "radius": 0.5}),
        ("localization_error", {"max": 1}, {"after": 0.0}),
        (
            "localization_consistency",
            {},
            {"probability": 0.95, "every": 5.0, "after": 0.0, "both_sides": False},
        ),
        ("relocalized_within", {"time": 5}, {"tolerance": 0.25, "yaw_tolerance": 0.25, "hold": 1.0, "after": None}),
        (
            "stopped_within",
            {"time": 1, "after": "lidar.off"},
            {"speed": 0.02, "turn_rate": 0.05, "hold": 0.2, "stay": False},
        ),
    ],
)
def test_defaults_match_the_reference(kind, keys, defaults):
    found = spec(kind, keys)
    assert {key: getattr(found, key) for key in defaults} == defaults


def test_only_clearance_needs_clearance_up_to_half_a_meter_beyond_its_bound():
    assert spec("clearance", {"min": 3}).clearance_range == 3.5
    others = [spec("speed", {"max": 1}), spec("collisions", {}), spec("goals_reached", {})]
    assert [isinstance(other, Criterion) and other.clearance_range for other in others] == [0.0, 0.0, 0.0]
