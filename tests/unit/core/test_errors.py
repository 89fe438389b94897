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
    there = pickle.loads(pickle.dumps(error))
    assert type(there) is type(error)
    assert (str(there), there.exit, vars(there)) == (str(error), error.exit, vars(error))


def test_every_error_class_is_tested() -> None:
    tried = {InvalidInput, UsageError, NothingSelected, RunError}
    assert set(SimscenError.__subclasses__()) == tried
