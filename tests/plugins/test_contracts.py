"""Contract tests of the example package."""

import pytest

from simscen.spec.registry import find
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
    entry = find(kind, name)
    assert entry is not None
    promises = promises_of(entry.load().model_validate(VALUES[kind, name]), name)
    assert len(promises) >= 2
    for promise in promises:
        promise.check()


@pytest.mark.parametrize(
    ("target", "told"),
    [("reversing=0.1", 3), ("reversing", "e.g. reversing=1.0"), ("dwell=3", "3 is not a JSON object")],
)
def test_a_bare_value_is_given_as_it_is_written(yardwork, target: str, told: int | str) -> None:
    if isinstance(told, int):
        assert len(promises_of_target(target)) == told
        return
    with pytest.raises(InvalidTarget) as wrong:
        promises_of_target(target)
    assert told in str(wrong.value)
