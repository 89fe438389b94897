"""OMPL search for the cheapest path over positions (x, y), with a seed and a maximum number of iterations."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, repeat
from typing import Any

from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from simscen.model.planners import OmplPlanner as PlannerSpec

Point = tuple[float, float]
MotionCost = Callable[[float, float, float, float], float]
"""Function that returns the cost of a motion from (x, y) to (x, y): at least its length in m; inf if it is blocked."""
Termination = Callable[[], bool]
"""Termination condition: OMPL calls this function in each iteration, and stops when it returns True."""

PLANNERS: dict[str, Callable[[Any], Any]] = {
    "rrt_connect": og.RRTConnect,
    "rrt_star": og.RRTstar,
    "informed_rrt_star": og.InformedRRTstar,
    "bit_star": og.BITstar,
    "aorrtc": og.AORRTC,
    "kpiece": og.KPIECE1,
}
"""Constructors of OMPL's planners by the `type` in the specification. The argument is OMPL's SpaceInformation."""
FIRST_PATH_PLANNERS = frozenset(("rrt_connect", "kpiece"))
"""Types of planners that stop at their first path. All other planners continue to improve the path."""
DEFAULT_RANGE_M = 1.0
"""Default of the parameter `range`: the maximum length of a motion in the search tree."""
DEFAULT_BIT_STAR_REWIRE_FACTOR = 1.3
"""Default of the parameter `rewire_factor` of BIT*."""
CHECK_PERIOD_ITERATIONS = 16
"""Number of iterations between two calls of `is_done` (see `stop_after`)."""
PERTURBATIONS_M = (0.5, 0.15)
"""Distances by which path simplification moves states, in two successive passes."""
ou.setLogLevel(ou.LOG_NONE)  # OMPL warns that seeding its random generator again has no effect, which is wrong


@dataclass(frozen=True)
class Problem:
    """Search problem: find a path from `start` to `goal` within `bounds` (min x, min y, max x, max y), all in m."""

    start: Point
    goal: Point
    bounds: tuple[float, float, float, float]
    motion_cost: MotionCost


class _MotionValidator(ob.MotionValidator):  # type: ignore[misc] # ompl has no types
    """Accepts motions with a finite cost."""

    def __init__(self, information: Any, motion_cost: MotionCost) -> None:
        super().__init__(information)
        self.motion_cost = motion_cost

    def checkMotion(self, a: Any, b: Any) -> bool:
        """Return whether the straight motion is possible."""
        return self.motion_cost(a[0], a[1], b[0], b[1]) < math.inf


class _CostBeyondLengthObjective(ob.OptimizationObjective):  # type: ignore[misc] # ompl has no types
    """Objective: the cost of a motion minus its length."""

    def __init__(self, information: Any, motion_cost: MotionCost) -> None:
        super().__init__(information)
        self.motion_cost = motion_cost

    def motionCost(self, a: Any, b: Any) -> Any:
        """Return the cost of the straight motion minus its length."""
        ax, ay, bx, by = a[0], a[1], b[0], b[1]
        return ob.Cost(self.motion_cost(ax, ay, bx, by) - math.hypot(bx - ax, by - ay))

    def stateCost(self, _: Any) -> Any:
        """Return 0, because only motions have costs."""
        return ob.Cost(0.0)


class _MotionCostObjective(ob.PathLengthOptimizationObjective):  # type: ignore[misc] # ompl has no types
    """Objective: the cost of a motion. Derived from OMPL's path length, so that OMPL supports informed sampling."""

    def __init__(self, information: Any, motion_cost: MotionCost) -> None:
        super().__init__(information)
        self.motion_cost = motion_cost

    def motionCost(self, a: Any, b: Any) -> Any:
        """Return the cost of the straight motion."""
        return ob.Cost(self.motion_cost(a[0], a[1], b[0], b[1]))

    def motionCostHeuristic(self, a: Any, b: Any) -> Any:
        """Return the length of the motion, a lower bound of its cost."""
        return ob.Cost(math.hypot(b[0] - a[0], b[1] - a[1]))


class StateValidity:
    """Accepts states that are not in a blocked cell."""

    def __init__(self, motion_cost: MotionCost) -> None:
        self.motion_cost = motion_cost

    def __call__(self, state: Any) -> bool:
        """Return whether a state of OMPL is valid."""
        x, y = state[0], state[1]
        return self.motion_cost(x, y, x, y) < math.inf


class OmplSearch:
    """One search by a planner of OMPL. Subclasses may override `_make_validity` and `_make_termination`."""

    def __init__(self, spec: PlannerSpec, problem: Problem, seed: int) -> None:
        self.spec, self.problem, self.seed = spec, problem, seed
        self._callbacks: list[Any] = []

    def solve(self, *, simplify: bool) -> list[Point] | None:
        """Return the points of a path from start to goal; None if the search does not reach the goal.

        With `simplify`, the path is shortened, and its states are moved to reduce the cost.
        """
        try:
            return self._solve(simplify)
        finally:
            for callback in self._callbacks:  # OMPL's bindings leak callbacks, which must not keep the costmap alive
                callback.motion_cost = lambda *_: math.inf

    def _solve(self, simplify: bool) -> list[Point] | None:
        ou.RNG.setSeed(self.seed)  # global; must be called before any object of OMPL is created
        problem, information = self.problem, self._make_information()
        motions = information.getMotionValidator()
        ends = _state(information, problem.start), _state(information, problem.goal)
        if not all(information.satisfiesBounds(end) and information.isValid(end) for end in ends):
            return None  # otherwise, a planner waits for a valid goal, 5 ms per iteration
        definition = ob.ProblemDefinition(information)
        definition.setStartAndGoalStates(*ends)
        objective = self._make_objective(information)
        definition.setOptimizationObjective(objective)
        planner = PLANNERS[self.spec.type](information)
        self._configure(planner)
        if self.spec.type == "bit_star":
            # BIT* itself drops motions with infinite cost. This validator accepts all motions without calling Python.
            everywhere_free = ob.SpaceInformation(information.getStateSpace())
            everywhere_free.setStateValidityChecker(ob.AllValidStateValidityChecker(everywhere_free))
            everywhere_free.setup()
            information.setMotionValidator(everywhere_free.getMotionValidator())
        planner.setProblemDefinition(definition)
        planner.setup()
        planner.solve(ob.PlannerTerminationCondition(self._make_termination(planner)))
        if not definition.hasExactSolution():
            return None
        path = definition.getSolutionPath()
        if simplify:
            information.setMotionValidator(motions)
            _simplify(og.PathSimplifier(information, definition.getGoal(), objective), path, self.spec.simplify_steps)
        return [(state[0], state[1]) for state in path.getStates()]

    def _configure(self, planner: Any) -> None:
        """Set the parameters of OMPL's planner."""
        if self.spec.type == "bit_star":
            planner.setUseKNearest(False)
            planner.setRewireFactor(DEFAULT_BIT_STAR_REWIRE_FACTOR)
        elif hasattr(planner, "setRange"):
            planner.setRange(DEFAULT_RANGE_M)
        set_parameters(planner, self.spec)

    def _make_termination(self, planner: Any) -> Termination:
        """Return the termination condition: `max_iterations`, or a path that has been improved enough."""
        spec = self.spec
        if spec.type in FIRST_PATH_PLANNERS:
            return stop_after(spec.max_iterations)

        def is_solved() -> bool:
            return math.isfinite(planner.bestCost().value())

        if spec.type == "bit_star":
            batches = planner.numBatches
            return stop_after(spec.max_iterations, lambda: batches() > spec.max_batches and is_solved())
        return stop_after(spec.max_iterations, is_solved, spec.improving_iterations)

    def _make_validity(self) -> StateValidity:
        """Return the check of single states."""
        return StateValidity(self.problem.motion_cost)

    def _make_information(self) -> Any:
        """Return OMPL's SpaceInformation: the bounds, and the checks of states and motions."""
        space, limits, bounds = ob.RealVectorStateSpace(2), ob.RealVectorBounds(2), self.problem.bounds
        for axis in (0, 1):
            limits.setLow(axis, bounds[axis])
            limits.setHigh(axis, bounds[axis + 2])
        space.setBounds(limits)
        information = ob.SpaceInformation(space)
        validity, motions = self._make_validity(), _MotionValidator(information, self.problem.motion_cost)
        self._callbacks += [validity, motions]
        information.setStateValidityChecker(validity)
        information.setMotionValidator(motions)
        information.setup()
        return information

    def _make_objective(self, information: Any) -> Any:
        """Return the objective: the cost of motions.

        For speed, it is the sum of OMPL's path length, which OMPL computes in C++, and the cost beyond the length.
        Informed RRT* needs one objective that is derived from the path length.
        """
        motion_cost = self.problem.motion_cost
        if self.spec.type == "informed_rrt_star":
            objective = _MotionCostObjective(information, motion_cost)
            self._callbacks.append(objective)
            return objective
        beyond = _CostBeyondLengthObjective(information, motion_cost)
        self._callbacks.append(beyond)
        total = ob.MultiOptimizationObjective(information)
        total.addObjective(ob.PathLengthOptimizationObjective(information), 1.0)
        total.addObjective(beyond, 1.0)
        ratio = self.spec.cost_threshold_ratio
        total.setCostThreshold(ob.Cost(ratio * math.dist(self.problem.start, self.problem.goal)))
        return total


def set_parameters(planner: Any, spec: PlannerSpec) -> None:
    """Set parameters of the specification on a planner of OMPL. Skip unset and unsupported parameters."""
    for setter, value in (
        ("setSamplesPerBatch", spec.samples_per_batch),
        ("setRewireFactor", spec.rewire_factor),
        ("setRange", spec.range),
        ("setGoalBias", spec.goal_bias),
    ):
        if value is not None and hasattr(planner, setter):
            getattr(planner, setter)(value)


def _simplify(simplifier: Any, path: Any, steps: int) -> None:
    """Shorten a path, and move states of the path if this reduces the cost, in passes of at most `steps` steps.

    OMPL's simplify() is not used, because it stops by wall-clock time.
    """
    simplifier.partialShortcutPath(path, steps, steps // 2)
    for distance in PERTURBATIONS_M:
        simplifier.perturbPath(path, distance, steps, steps // 2)
    simplifier.partialShortcutPath(path, steps, steps // 2)


def _state(information: Any, point: Point) -> Any:
    """Return a state of OMPL at a point."""
    state = information.allocState()
    state[0], state[1] = point
    return state


def stop_after(iterations: int, is_done: Termination = lambda: False, min_iterations: int = 0) -> Termination:
    """Return a condition that ends a search after `iterations` iterations, or earlier if `is_done` returns True.

    The search has at least `min_iterations` iterations. `is_done` is called once per CHECK_PERIOD_ITERATIONS.
    """

    def answers() -> Iterator[Iterable[bool]]:
        for start in range(0, iterations, CHECK_PERIOD_ITERATIONS):
            yield repeat(False, min(CHECK_PERIOD_ITERATIONS, iterations - start))
            if start + CHECK_PERIOD_ITERATIONS > min_iterations and is_done():
                break
        yield repeat(True)

    return chain.from_iterable(answers()).__next__  # itertools answers most calls without running Python code
