"""Tests of OMPL searches for points: invalid start or goal, costs, samples, and seeds."""

import math
from itertools import pairwise

import numpy as np
import pytest

from simscen.advanced.planners.bit_star_searches import SampledSearch
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.planners.ompl_search import PLANNERS, OmplSearch, Point, Problem

BOUNDS = (0.0, 0.0, 4.0, 4.0)


def search(
    kind: str, problem: Problem, seed: int, iterations: int, improving: int, simplify: bool = False
) -> list[Point] | None:
    spec = PlannerSpec(type=kind, max_iterations=iterations, improving_iterations=improving)
    return OmplSearch(spec, problem, seed).solve(simplify=simplify)


def left_half_cost(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the cost of a motion: its length for x < 2, and infinity otherwise."""
    return math.hypot(bx - ax, by - ay) if max(ax, bx) < 2.0 else math.inf


def cost_with_expensive_half(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the cost of a motion: its length, with ten times the cost for y < 2."""
    rate = 1.0 + 9.0 * float(np.mean(np.linspace(ay, by, 20) < 2.0))
    return rate * math.hypot(bx - ax, by - ay)


@pytest.mark.parametrize("kind", sorted(PLANNERS))
@pytest.mark.parametrize(
    ("start", "goal"),
    [((1.0, 1.0), (3.0, 3.0)), ((3.0, 1.0), (1.0, 3.0)), ((1.0, 1.0), (1.0, 5.0)), ((1.0, -1.0), (1.0, 3.0))],
    ids=["goal not free", "start not free", "goal out of bounds", "start out of bounds"],
)
def test_impossible_start_or_goal_is_reported_before_any_iteration(kind: str, start, goal) -> None:
    """OMPL would wait 5 ms per iteration for a valid start or goal, which is endless with that many iterations."""
    assert search(kind, Problem(start, goal, BOUNDS, left_half_cost), 1, 10**6, 1) is None


PROBLEM = Problem((0.5, 1.9), (3.5, 1.9), BOUNDS, cost_with_expensive_half)


def cost(points: list[tuple[float, float]]) -> float:
    return sum(cost_with_expensive_half(*a, *b) for a, b in pairwise(points))


@pytest.mark.parametrize("kind", ["rrt_star", "informed_rrt_star", "bit_star"])
def test_optimizing_planners_avoid_expensive_cells(kind: str) -> None:
    """The straight path costs 30, and the path over cheap ground 4.9."""
    points = search(kind, PROBLEM, 1, 9000, 400 if kind != "bit_star" else 3000)
    assert points is not None
    assert cost(points) < 8.0


def test_feasible_planners_ignore_costs() -> None:
    paths = [search("rrt_connect", PROBLEM, seed, 3000, 400) for seed in range(1, 6)]
    assert max(cost(path) for path in paths if path is not None) > 15.0


def test_bit_star_uses_only_the_given_samples() -> None:
    samples = np.array([(0.7, 3.0), (2.0, 3.1), (3.3, 3.0), (2.0, 0.5)])
    points = SampledSearch(PROBLEM, samples, 2.3, 1, 3000).solve(simplify=False)
    assert points is not None
    assert {*points[1:-1]} <= {*map(tuple, samples.tolist())}
    assert len(points) > 2


@pytest.mark.parametrize("kind", sorted(PLANNERS))
def test_same_seed_gives_the_same_path(kind: str) -> None:
    first, second = (search(kind, PROBLEM, 7, 2000, 50) for _ in range(2))
    assert first == second
