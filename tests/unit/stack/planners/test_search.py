"""OMPL's search: what it is asked for that cannot be."""

import pytest

from simscen.stack.planners import search as module
from simscen.stack.planners.search import PLANNERS, search

BOUNDS = (0.0, 0.0, 10.0, 10.0)


@pytest.mark.parametrize("kind", PLANNERS)
@pytest.mark.parametrize("closed", [(9.0, 9.0), (0.5, 0.5)], ids=["goal", "start"])
def test_no_iteration_is_spent_on_a_start_or_goal_that_is_not_free(kind, closed, monkeypatch):
    asked = []
    monkeypatch.setattr(module, "after", lambda iterations: lambda: bool(asked.append(iterations)) or len(asked) > 3)
    assert search(kind, BOUNDS, (0.5, 0.5), (9.0, 9.0), lambda a, b, c, d: (c, d) != closed, 1, 3) is None
    assert asked == []
