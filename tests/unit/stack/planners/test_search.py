import pytest

from simscen.stack.planners.search import PLANNERS, search

BOUNDS = (0.0, 0.0, 4.0, 4.0)


def left_half(ax: float, ay: float, bx: float, by: float) -> bool:
    return max(ax, bx) < 2.0


@pytest.mark.parametrize("kind", sorted(PLANNERS))
@pytest.mark.parametrize(
    ("start", "goal"),
    [((1.0, 1.0), (3.0, 3.0)), ((3.0, 1.0), (1.0, 3.0)), ((1.0, 1.0), (1.0, 5.0)), ((1.0, -1.0), (1.0, 3.0))],
    ids=["goal not free", "start not free", "goal out of bounds", "start out of bounds"],
)
def test_ends_that_cannot_be_are_told_before_any_iteration(kind: str, start, goal) -> None:
    """OMPL would sleep 5 ms an iteration in wait for better ones: for ever, with so many."""
    assert search(kind, BOUNDS, start, goal, left_half, 1, 10**9) is None
