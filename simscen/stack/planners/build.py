"""From a specification to a planner of OMPL."""

from simscen.model.planners import OmplPlanner as PlannerSpec
from simscen.stack.planners.ompl_planner import OmplPlanner
from simscen.stack.planners.pose_planner import PosePlanner
from simscen.stack.protocols import Planner
from simscen.stack.setting import Setting

LONG = 2.0
"""A hull whose circumscribed radius is this many times its inscribed one fits where only its heading lets it."""


def ompl_planner(spec: PlannerSpec, setting: Setting) -> Planner:
    """A planner in the state space that is asked for, or that fits the robot.

    auto: Reeds-Shepp for a base with a turning radius, else "se2" for a long hull, else a disc in the plane. A base
    that cannot move sideways gets "se2" as Dubins paths on tight arcs: its heading is that of its path.
    """
    robot, space = setting.robot, spec.state_space
    if space == "auto":
        if robot.turning_radius > 0.0:
            space = "reeds_shepp"
        else:
            space = "se2" if robot.circumscribed_radius > LONG * robot.inscribed_radius else "holonomic"
    if space == "holonomic":
        return OmplPlanner(spec, robot)
    if space == "se2" and not robot.holonomic:
        space = "dubins"
    return PosePlanner(spec, robot, setting.footprint, space)
