"""Stack components of a package for tests: some work, some are defective; `defect` selects how a planner fails."""

import math

import numpy as np

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Belief, Path
from simscen.core.records.trace import Decision
from simscen.model.controllers import ControllerSpec, GoalCheckerSpec
from simscen.model.localizers import LocalizerSpec
from simscen.model.planners import OmplPlanner, PlannerSpec
from simscen.model.recovery import BehaviorSpec
from simscen.model.stack import InProcessStack
from simscen.spec.quantities import PositiveLength
from simscen.stack.planners.ompl_planner import ompl_planner


class Straight(PlannerSpec):
    """Planner that returns a straight line, or fails in the way that `defect` names."""

    component = "odd:StraightPlanner"
    spacing: PositiveLength = 0.05
    """Distance between two points of the path."""
    defect: str = ""


class StraightPlanner:
    def __init__(self, spec, setting):
        self.spec, self.setting = spec, setting
        setting.rng.random(1000)
        if spec.defect == "raise in constructor":
            raise OSError("no such model")

    def plan(self, costmap, start, goal, seed):
        count = max(2, math.ceil(start.distance(goal) / self.spec.spacing) + 1)
        points = np.array(start) + np.linspace(0, 1, count)[:, None] * (np.array(goal) - np.array(start))
        match self.spec.defect:
            case "raise":
                return {}["no such key"]
            case "raise deep":
                return np.linalg.inv(np.zeros((2, 2)))
            case "nan":
                points[1, 0] = math.nan
            case "shape":
                points = points[:, :2]
            case "list":
                return points.tolist()
            case "empty":
                points = points[:0]
            case "other start":
                points = points + 0.5
        return Path(points)


class RandomDraws(PlannerSpec):
    """OMPL planner that first draws many random numbers."""

    component = "odd:random_draws"


def random_draws(spec, setting):
    setting.rng.random(1000)
    return ompl_planner(OmplPlanner(), setting)


class Infinite(ControllerSpec):
    """Controller that commands an infinite velocity."""

    component = "odd:InfiniteController"


class InfiniteController:
    full_speed, local_plan = 0.5, None

    def __init__(self, spec, setting):
        pass

    def set_path(self, path):
        pass

    def set_speed_limit(self, limit):
        pass

    def command(self, pose, twist, costmap, goal):
        return Twist(math.inf)


class WrongShape(LocalizerSpec):
    """Localizer whose covariance has a wrong shape."""

    component = "odd:WrongShapeLocalizer"


class WrongShapeLocalizer:
    def __init__(self, spec, setting):
        pass

    def reset(self, estimate):
        self.belief = Belief(estimate.pose, np.eye(2))

    def on_odometry(self, odometry):
        pass

    on_scan = on_imu = on_odometry


class Incomplete(LocalizerSpec):
    """Localizer without the methods for readings."""

    component = "odd:IncompleteLocalizer"


class IncompleteLocalizer:
    def __init__(self, spec, setting):
        pass

    def reset(self, estimate):
        pass


class Pause(BehaviorSpec):
    """Behavior that waits for `wait_duration` s."""

    component = "odd:PauseBehavior"
    wait_duration: float = 0.2


class PauseBehavior:
    name = "a name that simscen ignores"

    def __init__(self, spec, setting):
        self.spec = spec

    def start(self, pose):
        pass

    def step(self, pose, costmap, seconds):
        return STOP if seconds < self.spec.wait_duration else None


class NotBoolean(GoalCheckerSpec):
    """Goal checker that returns a string instead of a Boolean."""

    component = "odd:NotBooleanChecker"


class NotBooleanChecker:
    def __init__(self, spec, setting):
        pass

    def reset(self):
        pass

    def reached(self, goal, pose, twist):
        return "perhaps"


class Stop(InProcessStack):
    """Stack that stops the robot, and returns no valid decisions from tick 60 on."""

    component = "odd:StopStack"
    patience: float = 1.0


class StopStack:
    plan = goal = None

    def __init__(self, spec, setting):
        self.setting = setting

    def start(self, estimate, goals):
        pass

    def preempt(self, tick, goal):
        pass

    cancel = preempt

    def decide(self, tick, readings):
        return Decision(STOP) if tick < 60 else "stop" if tick < 120 else None
