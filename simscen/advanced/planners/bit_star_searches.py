"""BIT* searches of the medial-axis planner, in the order in which they are tried."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from simscen.advanced.planners.informed_set import InformedSet
from simscen.advanced.planners.medial_axis_samples import medial_axis_samples
from simscen.core.geometry import Array
from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.planners.endpoints import Endpoints
from simscen.stack.planners.ompl_planner import make_problem
from simscen.stack.planners.ompl_search import MotionCost, OmplSearch, Point, Problem, StateValidity, Termination
from simscen.stack.planners.traversal_costs import TraversalCosts

DENSITIES = (1, 2, 4, 8)
"""Values of `density` in successive searches of the entire costmap."""
CORRIDOR_SLACKS = (0.05, 0.15, 1.0)
"""Ratios by which paths in successive corridors may be longer than the shortest path over the coarse grid."""
COST_SLACK = 0.15
"""Ratio by which paths in the first search may cost more than the cheapest path over the coarse grid."""
MAX_SAMPLES = 3000
"""Maximum number of samples of the first search. BIT* takes about ten iterations for each."""
FIRST_REACH_M = 1.8
"""Distance up to which BIT* connects samples in the first search."""
LATER_REACH_M = 2.3
"""Distance up to which BIT* connects samples in later searches; divided by `density`."""
AMPLE_CLEARANCE_M = 0.15
"""Clearance beyond the robot's radius that suffices for straight motions between samples."""


@dataclass(frozen=True, eq=False)
class Leg:
    """A part of the path, to be found by BIT*.

    BIT* connects the `samples` (n, 2) up to a distance of `reach` m. If `samples` is None, BIT* draws its own samples.
    """

    problem: Problem
    samples: Array | None = None
    reach: float = LATER_REACH_M

    def solve(self, seed: int, max_iterations: int) -> list[Point] | None:
        """Return the points of this part of the path; None if BIT* finds none."""
        search = (
            OmplSearch(PlannerSpec(max_iterations=max_iterations), self.problem, seed)
            if self.samples is None
            else SampledSearch(self.problem, self.samples, self.reach, seed, max_iterations)
        )
        return search.solve(simplify=False)


def searches(costs: TraversalCosts, ends: Endpoints, seed: int) -> Iterator[Iterator[Leg]]:
    """Yield the searches to try one after the other. A search is an iterator of successive legs from start to goal.

    The first search samples the region of near-cheapest paths over a coarse grid. If the entire costmap has more than
    MAX_SAMPLES samples, searches in corridors of near-shortest paths follow. The last searches sample the entire
    costmap with increasing density.
    """
    problem, samples = make_problem(costs, ends), medial_axis_samples(costs.costmap, ends.reachable, seed)
    yield iter((Leg(problem, _cheap_samples(costs, ends, samples), FIRST_REACH_M),))
    if len(samples) > MAX_SAMPLES:
        informed = InformedSet(costs, ends.start, ends.goal)
        for slack in CORRIDOR_SLACKS:
            yield _corridor_legs(costs, ends, informed, slack)
    for density in DENSITIES:
        samples = medial_axis_samples(costs.costmap, ends.reachable, seed, density)
        yield iter((Leg(problem, samples, LATER_REACH_M / density),))


def _cheap_samples(costs: TraversalCosts, ends: Endpoints, samples: Array) -> Array:
    """Return the samples on near-cheapest paths over the coarse grid, and points of the cheapest path (n, 2)."""
    informed = InformedSet(costs, ends.start, ends.goal, by_cost=True)
    informed.restrict(COST_SLACK)
    chosen = samples[informed.contains_points(samples)]
    if len(chosen) > MAX_SAMPLES:
        chosen = chosen[np.argsort(informed.lengths_through(chosen), kind="stable")[:MAX_SAMPLES]]
    path = informed.path(costs.costmap, costs.inscribed + AMPLE_CLEARANCE_M)
    return np.vstack((chosen, path[np.isfinite(costs.at(path))]))


def _corridor_legs(costs: TraversalCosts, ends: Endpoints, informed: InformedSet, slack: float) -> Iterator[Leg]:
    """Yield the legs of a path in the corridor of near-shortest paths over the coarse grid.

    A leg must be solved before the next one is taken, because `informed` is restricted to the current leg.
    """
    waypoints = informed.waypoints(costs.costmap) if slack < 1.0 else []
    leg_start, distance_before = ends.start, 0.0
    for waypoint, distance in [*waypoints, (ends.goal, np.inf)]:
        informed.restrict(slack, (distance_before, distance))
        yield Leg(Problem(leg_start, waypoint, informed.bounds(), _motion_cost_within(costs.between, informed)))
        leg_start, distance_before = waypoint, distance


def _motion_cost_within(motion_cost: MotionCost, informed: InformedSet) -> MotionCost:
    """Return a cost function of motions: `motion_cost` within the informed set, otherwise inf.

    Only both ends and the middle of a motion are tested.
    """
    contains = informed.contains

    def confined_cost(ax: float, ay: float, bx: float, by: float) -> float:
        is_inside = contains(0.5 * (ax + bx), 0.5 * (ay + by)) and contains(bx, by) and contains(ax, ay)
        return motion_cost(ax, ay, bx, by) if is_inside else np.inf

    return confined_cost


CHECKS_BEFORE_FIRST_BATCH = 4
"""Number of evaluations of the termination condition by BIT* before its first batch is complete."""


class _SampledValidity(StateValidity):
    """Validity check that also replaces each state that BIT* draws by the next of the given samples.

    OMPL's Python bindings (2.0.1) do not support custom state samplers.
    """

    def __init__(self, problem: Problem, samples: Array) -> None:
        super().__init__(problem.motion_cost)
        self._ends = (problem.start, problem.goal)
        self._remaining: Iterator[list[float]] = iter(samples.tolist())

    def __call__(self, state: Any) -> bool:
        """Set a drawn state to the next sample and return True, or return False after the last sample.

        Start and goal are checked without a change.
        """
        if (state[0], state[1]) in self._ends:
            return super().__call__(state)
        sample = next(self._remaining, None)
        if sample is None:
            return False
        state[0], state[1] = sample
        return True


class SampledSearch(OmplSearch):
    """Search with one batch of BIT* on `samples` (n, 2), which are connected if they are at most `reach` m apart."""

    def __init__(self, problem: Problem, samples: Array, reach: float, seed: int, max_iterations: int) -> None:
        all_samples = PlannerSpec(max_iterations=max_iterations, cost_threshold_ratio=0.0)
        super().__init__(all_samples, problem, seed)
        self._samples, self._reach = samples, reach

    def _make_validity(self) -> StateValidity:
        return _SampledValidity(self.problem, self._samples)

    def _configure(self, planner: Any) -> None:
        planner.setUseKNearest(False)
        planner.setSamplesPerBatch(len(self._samples))
        planner.setRewireFactor(self._reach / _connection_radius(self.problem.bounds, len(self._samples) + 2))

    def _make_termination(self, planner: Any) -> Termination:
        """Return a condition that stops BIT* after the first batch, or after the maximum number of iterations."""
        batches, remaining = planner.numBatches, self.spec.max_iterations

        def should_stop() -> bool:
            nonlocal remaining
            remaining -= 1
            if remaining == self.spec.max_iterations - CHECKS_BEFORE_FIRST_BATCH:
                planner.setSamplesPerBatch(1)
            return remaining < 0 or batches() > 1

        return should_stop


def _connection_radius(bounds: tuple[float, float, float, float], states: int) -> float:
    """Return the connection radius in m of BIT* (r of RRG) for a number of states and a rewire factor of 1."""
    area = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])
    return 2.0 * math.sqrt(1.5 * area / math.pi * math.log(states) / states)
