"""Construction of OMPL's planners from their specification."""

from typing import Literal

from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.model.planners import StateSpace
from simscen.stack.planners.ompl_planner import OmplPlanner
from simscen.stack.planners.pose_planner import PosePlanner
from simscen.stack.protocols import Planner, RobotModel
from simscen.stack.setting import Setting

LONG_HULL_RATIO = 2.0
"""Ratio of circumscribed to inscribed radius from which a hull is planned with its heading."""


def ompl_planner(spec: PlannerSpec, setting: Setting) -> Planner:
    """Build a planner in the requested state space, or in the one that fits the robot."""
    space = state_space_for(spec.state_space, setting.robot)
    if space == "holonomic":
        return OmplPlanner(spec, setting.robot)
    return PosePlanner(spec, setting.robot, setting.footprint, space)


def state_space_for(requested: StateSpace, robot: RobotModel) -> Literal["holonomic", "se2", "dubins", "reeds_shepp"]:
    """Return the state space to plan in.

    auto: Reeds-Shepp for a base with a turning radius, otherwise "se2" for a long hull, otherwise the plane. For a base
    that cannot move sideways, "se2" becomes Dubins paths with tight arcs: its heading is that of its path.
    """
    space = requested
    if space == "auto":
        if robot.turning_radius > 0.0:
            space = "reeds_shepp"
        else:
            space = "se2" if robot.circumscribed_radius > LONG_HULL_RATIO * robot.inscribed_radius else "holonomic"
    return "dubins" if space == "se2" and not robot.holonomic else space
