"""Searches of the medial-axis planner, in the order in which they are tried, each wider than the one before."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simscen.advanced.planners.informed_set import InformedSet
from simscen.advanced.planners.medial_axis import medial_axis_samples
from simscen.advanced.planners.sampled_search import SampledSearch
from simscen.core.geometry import Array
from simscen.stack.planners.endpoints import Endpoints
from simscen.stack.planners.ompl_planner import whole_problem
from simscen.stack.planners.ompl_search import Motion, OmplSearch, Problem
from simscen.stack.planners.traversal_costs import TraversalCosts

DENSITIES = (1, 2, 4, 8)
"""Samples per meter of successive searches, as multiples of the usual number."""
CORRIDOR_SLACKS = (0.05, 0.15, 1.0)
"""How much longer than the shortest path of the coarse grid a path in the corridor may be, as a ratio."""
COST_SLACK = 0.15
"""How much more than the cheapest path of the coarse grid a path may cost to be searched; the grid errs by percents."""
MAX_SAMPLES = 3000
"""If there are more samples, only those on the cheapest paths are used. BIT* takes some ten iterations for each."""
REACH_M, FAR_REACH_M = 1.8, 2.3
"""Distance up to which samples are connected: with the path of the coarse grid among them, and without."""
AMPLE_CLEARANCE_M = 0.15
"""Clearance beyond the robot's radius that leaves room for a straight motion between samples."""


@dataclass(frozen=True, eq=False)
class Leg:
    """A part of a path to search: with BIT* on `samples` (n, 2), connected up to `reach` m, or on its own samples."""

    problem: Problem
    samples: Array | None = None
    reach: float = FAR_REACH_M

    def search(self, seed: int, max_iterations: int) -> OmplSearch:
        """Return the search."""
        if self.samples is None:
            return OmplSearch("bit_star", self.problem, seed, max_iterations, 0)
        return SampledSearch(self.problem, self.samples, self.reach, seed, max_iterations)


def searches(costs: TraversalCosts, ends: Endpoints, seed: int) -> Iterator[Iterator[Leg]]:
    """Yield searches, each as its successive legs.

    The first one samples the medial axis, and thinly the open, where a path can pass that costs little more than the
    cheapest one over the coarse grid. Then follow, if there were too many samples, the corridor, and at last samples
    everywhere, more and more of them.
    """
    problem, samples = whole_problem(costs, ends), medial_axis_samples(costs.costmap, ends.reachable, seed)
    yield iter((Leg(problem, _where_cheap(costs, ends, samples), REACH_M),))
    if len(samples) > MAX_SAMPLES:
        informed = InformedSet(costs, ends.start, ends.goal)
        for slack in CORRIDOR_SLACKS:
            yield _corridor_legs(costs, ends, informed, slack)
    for density in DENSITIES:
        samples = medial_axis_samples(costs.costmap, ends.reachable, seed, density)
        yield iter((Leg(problem, samples, FAR_REACH_M / density),))


def _where_cheap(costs: TraversalCosts, ends: Endpoints, samples: Array) -> Array:
    """Return the samples on paths that cost little more than the cheapest over the coarse grid, and points of that."""
    informed = InformedSet(costs, ends.start, ends.goal, priced=True)
    informed.narrow(COST_SLACK)
    held = samples[informed.holds(samples)]
    if len(held) > MAX_SAMPLES:
        held = held[np.argsort(informed.through(held), kind="stable")[:MAX_SAMPLES]]
    path = informed.way(costs.costmap, costs.inscribed + AMPLE_CLEARANCE_M)
    return np.vstack((held, path[np.isfinite(costs.at(path))]))


def _corridor_legs(costs: TraversalCosts, ends: Endpoints, informed: InformedSet, slack: float) -> Iterator[Leg]:
    """Yield the legs of a path in the corridor of near-shortest paths over the coarse grid.

    A leg must be solved before the next one is taken, because the corridor is narrowed to each leg in turn.
    """
    stops = informed.stops(costs.costmap) if slack < 1.0 else []
    here, before = ends.start, 0.0
    for stop, along in [*stops, (ends.goal, np.inf)]:
        informed.narrow(slack, (before, along))
        yield Leg(Problem(here, stop, informed.bounds(), _confined(costs.between, informed)))
        here, before = stop, along


def _confined(motion: Motion, informed: InformedSet) -> Motion:
    """Return the cost of a motion, inf outside the informed set."""
    has = informed.has

    def within(ax: float, ay: float, bx: float, by: float) -> float:
        inside = has(0.5 * (ax + bx), 0.5 * (ay + by)) and has(bx, by) and has(ax, ay)
        return motion(ax, ay, bx, by) if inside else np.inf

    return within
