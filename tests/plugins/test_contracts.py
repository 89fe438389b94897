"""Contract tests of the example package."""

import pytest

from simscen.spec.registry import find_type
from simscen.testing import promises_of
from simscen.testing.targets import InvalidTarget, promises_of_target

VALUES = {
    ("criterion", "dwell"): {"region": "yard", "max": 2.0},
    ("fault", "crosstalk"): {},
    ("trigger", "reversing"): 0.1,
    ("action", "turn_robot"): {"by": 1.0},
    ("sensor", "sonar"): {},
    ("metric", "reversed_length"): {},
}


@pytest.mark.parametrize(("kind", "name"), VALUES)
def test_types_of_the_package_meet_their_contracts(yardwork, kind: str, name: str) -> None:
    entry = find_type(kind, name)
    assert entry is not None
    promises = promises_of(entry.load().model_validate(VALUES[kind, name]), name)
    assert len(promises) >= 2
    for promise in promises:
        promise.check()


@pytest.mark.parametrize(
    ("target", "expected"),
    [("reversing=0.1", 3), ("reversing", "e.g. reversing=1.0"), ("dwell=3", "3 is not a JSON object")],
)
def test_contract_test_target_takes_a_value_or_json(yardwork, target: str, expected: int | str) -> None:
    if isinstance(expected, int):
        assert len(promises_of_target(target)) == expected
        return
    with pytest.raises(InvalidTarget) as wrong:
        promises_of_target(target)
    assert expected in str(wrong.value)
