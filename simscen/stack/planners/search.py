"""The search itself: OMPL's planners in the plane over a costmap's costs, limited by iterations and seeded.

OMPL's generator is global to the process: it is seeded anew for each plan, before any other OMPL object is made.
OMPL calls that a mistake in its log, yet it does what is wanted (measured), hence the silenced log.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from simscen.core.geometry import Array

Point = tuple[float, float]
Motion = Callable[[float, float, float, float], float]
"""The cost of going straight from (x, y) to (x, y), at least its length in meters; inf where the robot cannot."""

PLANNERS: dict[str, Callable[[Any], Any]] = {
    "rrt_connect": og.RRTConnect,
    "rrt_star": og.RRTstar,
    "informed_rrt_star": og.InformedRRTstar,
    "bit_star": og.BITstar,
    "aorrtc": og.AORRTC,
    "kpiece": og.KPIECE1,
}
SATISFIED = frozenset(("rrt_connect", "kpiece"))
"""These end with their first path; the others go on to improve it."""
RANGE = 1.0
"""Meters that a tree grows at most in one step. OMPL's default, a fifth of the map, mostly ends in walls of a house."""
BATCH = 200
"""Samples that BIT* draws at a time where it draws them itself."""
FIRST_DRAWN = 4
"""Times that BIT* asks whether to stop before its first batch is drawn, and one more."""
ou.setLogLevel(ou.LOG_NONE)


@dataclass(frozen=True, eq=False)
class Problem:
    """What is searched: `bounds` are (min x, min y, max x, max y).

    `samples` (n, 2) are those to use, if not OMPL's own, and `reach` the meters up to which two of them are joined.
    """

    start: Point
    goal: Point
    bounds: tuple[float, float, float, float]
    motion: Motion
    samples: Array | None = None
    reach: float = 2.3


class _Motions(ob.MotionValidator):  # type: ignore[misc] # ompl has no types
    """Answers OMPL's question about a motion with ours; one call in place of a call for each point on the way."""

    def __init__(self, information: Any, motion: Motion) -> None:
        super().__init__(information)
        self.motion = motion

    def checkMotion(self, a: Any, b: Any) -> bool:
        """Whether the straight motion is free."""
        return self.motion(a[0], a[1], b[0], b[1]) < math.inf


class _Dearer(ob.OptimizationObjective):  # type: ignore[misc] # ompl has no types
    """What a motion costs beyond its length."""

    def __init__(self, information: Any, motion: Motion) -> None:
        super().__init__(information)
        self.motion = motion

    def motionCost(self, a: Any, b: Any) -> Any:
        """Its cost along the straight line, less its length."""
        ax, ay, bx, by = a[0], a[1], b[0], b[1]
        return ob.Cost(self.motion(ax, ay, bx, by) - math.hypot(bx - ax, by - ay))

    def stateCost(self, _: Any) -> Any:
        """Standing costs nothing."""
        return ob.Cost(0.0)


class _Priced(ob.PathLengthOptimizationObjective):  # type: ignore[misc] # ompl has no types
    """The same in one: OMPL samples the ellipse of the informed set for an objective of length, and for no other."""

    def __init__(self, information: Any, motion: Motion) -> None:
        super().__init__(information)
        self.motion = motion

    def motionCost(self, a: Any, b: Any) -> Any:
        """Its cost along the straight line."""
        return ob.Cost(self.motion(a[0], a[1], b[0], b[1]))

    def motionCostHeuristic(self, a: Any, b: Any) -> Any:
        """Its length: no meter costs less than 1."""
        return ob.Cost(math.hypot(b[0] - a[0], b[1] - a[1]))


class _Validity:
    """Answers whether a state is free. Given samples it also puts each that OMPL draws on the next of them.

    OMPL's Python bindings have no way to give a planner a sampler of states (2.0.1); but BIT* asks for the validity of
    each state that it has drawn before it looks at it, and goes on with it as it is then.
    """

    def __init__(self, problem: Problem) -> None:
        self.motion = problem.motion
        self._ends = (problem.start, problem.goal)
        self._left: Iterator[list[float]] | None = None if problem.samples is None else iter(problem.samples.tolist())

    def __call__(self, state: Any) -> bool:
        x, y = state[0], state[1]
        if self._left is None or (x, y) in self._ends:
            return self.motion(x, y, x, y) < math.inf
        sample = next(self._left, None)
        if sample is None:
            return False
        state[0], state[1] = sample
        return True


_Asked = _Motions | _Dearer | _Priced | _Validity
"""All that OMPL asks."""


def _nowhere(_ax: float, _ay: float, _bx: float, _by: float) -> float:
    return math.inf


def search(kind: str, problem: Problem, seed: int, iterations: int, improving: int) -> list[Point] | None:
    """Points from start to goal, of least cost as far as the planner cares; None when the iterations did not suffice.

    A planner that improves its path does so for `improving` iterations, or until it has made the best of the samples
    it was given. OMPL's "approximate solution" counts as none.
    """
    asked: list[_Asked] = []
    try:
        return _searched(kind, problem, seed, iterations, improving, asked)
    finally:
        for one in asked:  # OMPL's bindings leak what is given to them: let go of the costmap
            one.motion = _nowhere


def _searched(
    kind: str, problem: Problem, seed: int, iterations: int, improving: int, asked: "list[_Asked]"
) -> list[Point] | None:
    ou.RNG.setSeed(seed)
    information = _information(problem, asked)
    ends = _state(information, problem.start), _state(information, problem.goal)
    if not all(information.satisfiesBounds(end) and information.isValid(end) for end in ends):
        return None  # a planner would wait for a better goal, 5 ms an iteration
    definition = ob.ProblemDefinition(information)
    definition.setStartAndGoalStates(*ends)
    definition.setOptimizationObjective(_objective(kind, information, problem.motion, asked))
    planner = PLANNERS[kind](information)
    if hasattr(planner, "setRange"):
        planner.setRange(RANGE)
    if kind == "bit_star":
        planner.setUseKNearest(False)
        planner.setSamplesPerBatch(BATCH if problem.samples is None else len(problem.samples))
        if problem.samples is not None:
            planner.setRewireFactor(problem.reach / _radius(problem.bounds, len(problem.samples) + 2))
    planner.setProblemDefinition(definition)
    planner.setup()
    planner.solve(ob.PlannerTerminationCondition(_over(kind, problem, planner, iterations, improving)))
    if not definition.hasExactSolution():
        return None
    return [(state[0], state[1]) for state in definition.getSolutionPath().getStates()]


def _radius(bounds: tuple[float, float, float, float], states: int) -> float:
    """Up to which distance BIT* joins so many states with a rewire factor of 1 (Karaman & Frazzoli's r of RRG)."""
    area = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])
    return 2.0 * math.sqrt(1.5 * area / math.pi * math.log(states) / states)


def _over(kind: str, problem: Problem, planner: Any, iterations: int, improving: int) -> Callable[[], bool]:
    """When this planner has done enough."""
    if problem.samples is not None:
        return _after_one_batch(planner, iterations)
    if kind in SATISFIED:
        return after(iterations)
    return after(iterations, lambda: math.isfinite(planner.bestCost().value()), improving)  # told of in the end only


def _after_one_batch(planner: Any, iterations: int) -> Callable[[], bool]:
    """Says stop when BIT* draws its second batch; so that this is a small one, it is told of it during the first."""
    batches, left = planner.numBatches, iterations

    def over() -> bool:
        nonlocal left
        left -= 1
        if left == iterations - FIRST_DRAWN:
            planner.setSamplesPerBatch(1)
        return left < 0 or batches() > 1

    return over


def _information(problem: Problem, asked: "list[_Asked]") -> Any:
    space = ob.RealVectorStateSpace(2)
    limits = ob.RealVectorBounds(2)
    for axis in (0, 1):
        limits.setLow(axis, problem.bounds[axis])
        limits.setHigh(axis, problem.bounds[axis + 2])
    space.setBounds(limits)
    information = ob.SpaceInformation(space)
    validity, motions = _Validity(problem), _Motions(information, problem.motion)
    asked += [validity, motions]
    information.setStateValidityChecker(validity)
    information.setMotionValidator(motions)
    information.setup()
    return information


def _objective(kind: str, information: Any, motion: Motion, asked: "list[_Asked]") -> Any:
    """Length, and what is dearer than it: so OMPL's own length is the heuristic, worked out without Python."""
    objective = (_Priced if kind == "informed_rrt_star" else _Dearer)(information, motion)
    asked.append(objective)
    if kind == "informed_rrt_star":
        return objective
    both = ob.MultiOptimizationObjective(information)
    both.addObjective(ob.PathLengthOptimizationObjective(information), 1.0)
    both.addObjective(objective, 1.0)
    return both


def _state(information: Any, point: Point) -> Any:
    state = information.allocState()
    state[0], state[1] = point
    return state


def after(iterations: int, done: Callable[[], bool] = lambda: False, least: int = 0) -> Callable[[], bool]:
    """A termination condition that is asked once an iteration: says stop after so many, or after `least` when done."""
    left = iterations

    def over() -> bool:
        nonlocal left
        left -= 1
        return left < 0 or (iterations - left > least and done())

    return over
