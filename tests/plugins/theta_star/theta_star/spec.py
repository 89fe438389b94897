"""Parameters of the planner in a scenario. Imports no engine, so that validation stays fast."""

from typing import ClassVar

from simscen.plugin import NonNegativeLength, PlannerSpec, PositiveLength


class ThetaStar(PlannerSpec):
    """Lazy Theta* (Nash, Koenig and Tovey 2010): A* on a grid with paths at any angle.

    Example: `stack: {planner: {type: theta_star, clearance: 15 cm}}`
    """

    component: ClassVar[str] = "theta_star.planner:ThetaStarPlanner"
    clearance: NonNegativeLength = 0.10
    """Room around the robot where there is room; it is halved, then given up, where there is none."""
    grid: PositiveLength = 0.10
    """Edge of a cell of the search, at least that of the costmap."""
