"""Components of a package for tests: some work, and some break their contracts in the way that `does` names."""

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
    """A straight line."""

    component = "odd:StraightPlanner"
    spacing: PositiveLength = 0.05
    """Between two points."""
    does: str = ""


class StraightPlanner:
    def __init__(self, spec, setting):
        self.spec, self.setting = spec, setting
        setting.rng.random(1000)
        if spec.does == "not begin":
            raise OSError("no such model")

    def plan(self, costmap, start, goal, seed):
        count = max(2, math.ceil(start.distance(goal) / self.spec.spacing) + 1)
        points = np.array(start) + np.linspace(0, 1, count)[:, None] * (np.array(goal) - np.array(start))
        match self.spec.does:
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
            case "nothing":
                points = points[:0]
            case "elsewhere":
                points = points + 0.5
        return Path(points)


class Careful(PlannerSpec):
    """OMPL's, drawing a lot."""

    component = "odd:careful"


def careful(spec, setting):
    setting.rng.random(1000)
    return ompl_planner(OmplPlanner(), setting)


class Wild(ControllerSpec):
    component = "odd:WildController"


class WildController:
    full_speed, local_plan = 0.5, None

    def __init__(self, spec, setting):
        pass

    def set_path(self, path):
        pass

    def set_speed_limit(self, limit):
        pass

    def command(self, pose, twist, costmap, goal):
        return Twist(math.inf)


class Lost(LocalizerSpec):
    component = "odd:LostLocalizer"


class LostLocalizer:
    def __init__(self, spec, setting):
        pass

    def reset(self, estimate):
        self.belief = Belief(estimate.pose, np.eye(2))

    def on_odometry(self, odometry):
        pass

    on_scan = on_imu = on_odometry


class Half(LocalizerSpec):
    component = "odd:HalfLocalizer"


class HalfLocalizer:
    def __init__(self, spec, setting):
        pass

    def reset(self, estimate):
        pass


class Nod(BehaviorSpec):
    """Wait a little."""

    component = "odd:Nodding"
    wait_duration: float = 0.2


class Nodding:
    name = "whatever it calls itself"

    def __init__(self, spec, setting):
        self.spec = spec

    def start(self, pose):
        pass

    def step(self, pose, costmap, seconds):
        return STOP if seconds < self.spec.wait_duration else None


class Unsure(GoalCheckerSpec):
    component = "odd:UnsureChecker"


class UnsureChecker:
    def __init__(self, spec, setting):
        pass

    def reset(self):
        pass

    def reached(self, goal, pose, twist):
        return "perhaps"


class Still(InProcessStack):
    """Does nothing."""

    component = "odd:StillStack"
    patience: float = 1.0


class StillStack:
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
