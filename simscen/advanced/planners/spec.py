"""Parameters of the advanced planner."""

from typing import ClassVar, Literal

from simscen.model.planners import OmplParameters


class MedialAxisPlanner(OmplParameters):
    """BIT* on samples of the medial axis near the cheapest path over a coarse grid, then an optimization of the path.

    For cars and long hulls: RRT-Connect over poses, confined to near-shortest paths over a coarse grid.
    """

    component: ClassVar[str] = "simscen.advanced.planners.medial_axis_planner:medial_axis_planner"
    type: Literal["medial_axis"]
