"""Tests that errors can be pickled between processes."""

import pickle

import pytest

from simscen.core.errors import InvalidInput, NothingSelected, Problem, RunError, SimscenError, UsageError

PROBLEM = Problem("a.yaml", 3, 4, "SC001", "what is wrong", "how to mend it")


@pytest.mark.parametrize(
    "error",
    [
        InvalidInput([PROBLEM]),
        UsageError("no such folder"),
        NothingSelected("none"),
        RunError("timeout", "late", "tail"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_survive_pickling(error: SimscenError) -> None:
    restored = pickle.loads(pickle.dumps(error))
    assert type(restored) is type(error)
    assert (str(restored), restored.exit, vars(restored)) == (str(error), error.exit, vars(error))


def test_every_error_class_is_tested() -> None:
    tested = {InvalidInput, UsageError, NothingSelected, RunError}
    assert set(SimscenError.__subclasses__()) == tested
