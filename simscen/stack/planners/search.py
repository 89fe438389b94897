"""The search itself: OMPL's planners in the plane, limited by iterations and seeded.

OMPL's generator is global to the process: it is seeded anew for each plan, before any other OMPL object is made.
OMPL calls that a mistake in its log, yet it does what is wanted (measured; FACTS.md), hence the silenced log.
"""

from collections.abc import Callable
from typing import Any

from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

Segment = Callable[[float, float, float, float], bool]
Point = tuple[float, float]

PLANNERS: dict[str, Callable[[Any], Any]] = {
    "rrt_connect": og.RRTConnect,
    "rrt_star": og.RRTstar,
    "informed_rrt_star": og.InformedRRTstar,
    "bit_star": og.BITstar,
    "aorrtc": og.AORRTC,
    "kpiece": og.KPIECE1,
}
RANGE = 1.0
"""Metres that a tree grows at most in one step. OMPL's default, a fifth of the map, mostly ends in walls of a house."""
ou.setLogLevel(ou.LOG_NONE)


class _Motions(ob.MotionValidator):  # type: ignore[misc] # ompl has no types
    """Answers OMPL's question about a motion with ours; one call in place of a call for each point on the way."""

    def __init__(self, information: Any, free: Segment) -> None:
        super().__init__(information)
        self._free = free

    def checkMotion(self, a: Any, b: Any) -> bool:
        """Whether the straight motion is free."""
        return self._free(a[0], a[1], b[0], b[1])


def search(
    kind: str,
    bounds: tuple[float, float, float, float],
    start: Point,
    goal: Point,
    free: Segment,
    seed: int,
    iterations: int,
) -> list[Point] | None:
    """Points from start to goal whose segments are all `free`; None when the iterations did not suffice.

    `bounds` is (min x, min y, max x, max y). OMPL's "approximate solution" counts as none.
    """
    ou.RNG.setSeed(seed)
    space = ob.RealVectorStateSpace(2)
    limits = ob.RealVectorBounds(2)
    for axis in (0, 1):
        limits.setLow(axis, bounds[axis])
        limits.setHigh(axis, bounds[axis + 2])
    space.setBounds(limits)
    information = ob.SpaceInformation(space)
    information.setStateValidityChecker(lambda state: free(state[0], state[1], state[0], state[1]))
    information.setMotionValidator(_Motions(information, free))
    information.setup()
    ends = _state(information, start), _state(information, goal)
    if not all(information.satisfiesBounds(end) and information.isValid(end) for end in ends):
        return None  # a planner would wait for a better goal, 5 ms an iteration
    problem = ob.ProblemDefinition(information)
    problem.setStartAndGoalStates(*ends)
    planner = PLANNERS[kind](information)
    if hasattr(planner, "setRange"):
        planner.setRange(RANGE)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(ob.PlannerTerminationCondition(after(iterations)))
    if not problem.hasExactSolution():
        return None
    return [(state[0], state[1]) for state in problem.getSolutionPath().getStates()]


def _state(information: Any, point: Point) -> Any:
    state = information.allocState()
    state[0], state[1] = point
    return state


def after(iterations: int) -> Callable[[], bool]:
    """A termination condition that is asked once an iteration and says stop after so many."""
    left = iterations

    def over() -> bool:
        nonlocal left
        left -= 1
        return left < 0

    return over
