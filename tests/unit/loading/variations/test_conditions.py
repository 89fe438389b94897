"""Conditions on varied values."""

from typing import Any

import pytest

from simscen.loading.variations.conditions import ConditionError, parse_condition

VALUES: dict[str, Any] = {
    "robot.pose.x": 1.0,
    "goals[0].pose.x": "250 cm",
    'goals["v1.2"].pose.x': 4,
    "faults.lidar.noise.std": "5 cm",
    "pass.clearance.min": "20 cm",
    "robot.model": "amr",
    "events.cart.speed": "36 km/h",
    "flag": True,
}


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("goals[0].pose.x > robot.pose.x + 1", True),
        ("goals[0].pose.x > robot.pose.x + 1.5", False),
        ("goals[0].pose.x >= robot.pose.x + '150 cm'", True),
        ('goals["v1.2"].pose.x == 4', True),
        ("0 < faults.lidar.noise.std <= '50 mm'", True),
        ("faults.lidar.noise.std < '1 cm' or robot.model == 'amr'", True),
        ("not (robot.model != 'amr')", True),
        ("value('pass.clearance.min') > 2 * faults.lidar.noise.std", True),
        ("abs(-robot.pose.x) + min(1, 2) * max(3, 4) / 2 - 1 == 2", True),
        ("hypot(3, 4) == 5 and wrap(7) < 1", True),
        ("min(robot.pose.x) == max(1)", True),
        ("events.cart.speed == 10", True),
        ("flag", True),
        ("not flag", False),
    ],
)
def test_conditions_count_in_si_units(text: str, holds: bool) -> None:
    assert parse_condition(text).holds(VALUES) is holds


@pytest.mark.parametrize(
    "text",
    ["", "a <", "lambda: 1", "[x for x in y]", "a.b()", "__import__('os')", "a if b else c", "x := 1", "a ** b",
     "a in b", "f'{a}'", "None", "a[b] < 1", "a[-1] < 1", "a[True] < 1", "(a + b).c < 1", "value(a) < 1", "abs() < 1",
     "open('x') < 1"],
)  # fmt: skip
def test_everything_else_is_refused(text: str) -> None:
    with pytest.raises(ConditionError):
        parse_condition(text)


@pytest.mark.parametrize(
    "text",
    ["robot.model < 1", "robot.pose.x", "robot.pose.x / 0 < 1", "1 + robot.model == 2", "wrap(1e999) < 1",
     "max(1, robot.model) == 1",
     "robot.model * 99999999999999 == 'amr'", "-flag < 1"],
)  # fmt: skip
def test_values_that_do_not_fit_are_errors(text: str) -> None:
    with pytest.raises(ConditionError, match=r"cannot be evaluated|instead of true or false"):
        parse_condition(text).holds(VALUES)
