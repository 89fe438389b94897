"""Tests of the effects and default values of the parameters of OMPL planners."""

import math
from itertools import pairwise
from typing import Any

import pytest
from ompl import base as ob
from ompl import geometric as og

from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.planners import ompl_search
from simscen.stack.planners.ompl_search import PLANNERS, OmplSearch, Point, Problem

BOUNDS = (0.0, 0.0, 8.0, 8.0)
ENDS = (0.5, 4.0), (7.5, 4.0)


def free_cost(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the cost of a motion in free space: its length."""
    return math.hypot(bx - ax, by - ay)


def wall_cost(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the cost of a motion with a wall at x = 4, which has an opening above y = 6: its length or infinity."""
    if (ax - 4.0) * (bx - 4.0) > 0.0:
        return free_cost(ax, ay, bx, by)
    crossing = ay + (by - ay) * (4.0 - ax) / (bx - ax) if bx != ax else min(ay, by)
    return free_cost(ax, ay, bx, by) if crossing > 6.0 else math.inf


def solve(motion: ompl_search.MotionCost, seed: int = 1, simplify: bool = False, **parameters: Any) -> list[Point]:
    points = OmplSearch(PlannerSpec(**parameters), Problem(*ENDS, BOUNDS, motion), seed).solve(simplify=simplify)
    assert points is not None
    return points


def length(points: list[Point]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(points))


def mean_length(**parameters: Any) -> float:
    return sum(length(solve(wall_cost, seed, **parameters)) for seed in range(1, 7)) / 6


@pytest.fixture
def planners(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Return the list to which each search appends its OMPL planner."""
    used: list[Any] = []

    def recording(make: Any) -> Any:
        def make_and_record(information: Any) -> Any:
            used.append(make(information))
            return used[-1]

        return make_and_record

    monkeypatch.setattr(ompl_search, "PLANNERS", {kind: recording(make) for kind, make in PLANNERS.items()})
    return used


def test_the_parameters_have_the_documented_default_values() -> None:
    spec = PlannerSpec()
    assert (spec.samples_per_batch, spec.max_batches, spec.cost_threshold_ratio) == (200, 2, 1.01)
    assert (spec.simplify_steps, spec.hull_clearance, spec.cusp_penalty, spec.pose_searches) == (100, 0.10, 1.0, 6)


@pytest.mark.parametrize("kind", ["rrt_star", "informed_rrt_star"])
def test_the_default_goal_bias_and_rewire_factor_are_those_of_ompl(kind: str, planners: list[Any]) -> None:
    solve(free_cost, type=kind)
    space = ob.RealVectorStateSpace(2)
    limits = ob.RealVectorBounds(2)
    limits.setHigh(1.0)
    space.setBounds(limits)
    default = og.RRTstar(ob.SpaceInformation(space))
    assert planners[-1].getGoalBias() == default.getGoalBias() == PlannerSpec().goal_bias
    assert planners[-1].getRewireFactor() == default.getRewireFactor() == 1.1
    assert planners[-1].getRange() == 1.0


def test_bit_star_has_the_given_batches_and_rewire_factor(planners: list[Any]) -> None:
    solve(wall_cost)
    assert (planners[-1].getSamplesPerBatch(), planners[-1].getRewireFactor()) == (200, 1.3)
    solve(wall_cost, samples_per_batch=70, rewire_factor=1.2)
    assert (planners[-1].getSamplesPerBatch(), planners[-1].getRewireFactor()) == (70, 1.2)


@pytest.mark.parametrize("batches", [1, 2, 4])
def test_bit_star_stops_when_it_has_processed_its_batches(batches: int, planners: list[Any]) -> None:
    solve(wall_cost, max_batches=batches)
    assert planners[-1].numBatches() == batches + 1


def test_more_batches_and_more_samples_shorten_the_path() -> None:
    few = mean_length(max_batches=1, samples_per_batch=50)
    assert mean_length(max_batches=6, samples_per_batch=50) < few
    assert mean_length(max_batches=1, samples_per_batch=600) < few


def test_a_path_below_the_cost_threshold_ends_the_search(planners: list[Any]) -> None:
    """The straight path is optimal, so the search continues only without a threshold."""
    solve(free_cost)
    assert planners[-1].numBatches() <= 1
    solve(free_cost, cost_threshold_ratio=0.0)
    assert planners[-1].numBatches() == 3


@pytest.mark.parametrize("kind", ["bit_star", "rrt_star"])
def test_a_high_cost_threshold_accepts_the_first_path(kind: str) -> None:
    assert mean_length(type=kind, cost_threshold_ratio=100.0) > mean_length(type=kind)


@pytest.mark.parametrize("kind", ["rrt_connect", "rrt_star"])
def test_no_motion_is_longer_than_the_range(kind: str) -> None:
    for max_length, options in ((1.0, {}), (0.4, {"range": 0.4})):
        points = solve(wall_cost, type=kind, improving_iterations=20, **options)
        assert max(math.dist(a, b) for a, b in pairwise(points)) <= max_length + 1e-6
    with_long_range = solve(wall_cost, type=kind, range=5.0)
    assert len(with_long_range) < len(points)


def test_goal_bias_of_one_gives_the_straight_path() -> None:
    assert length(solve(free_cost, type="rrt_star", goal_bias=1.0, improving_iterations=1)) == pytest.approx(7.0)
    assert length(solve(free_cost, type="rrt_star", improving_iterations=1)) > 7.05


def test_kpiece_has_the_given_goal_bias(planners: list[Any]) -> None:
    for goal_bias in (0.05, 0.3):
        solve(free_cost, type="kpiece", goal_bias=goal_bias)
        assert planners[-1].getGoalBias() == goal_bias


def test_a_larger_rewire_factor_shortens_the_path() -> None:
    assert mean_length(rewire_factor=2.0) < mean_length(rewire_factor=1.0)


def test_more_simplification_steps_shorten_the_path() -> None:
    few = mean_length(type="rrt_connect", simplify=True, simplify_steps=4)
    assert mean_length(type="rrt_connect", simplify=True, simplify_steps=400) < few
