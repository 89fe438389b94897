"""Construction of the advanced stack from its specification."""

from typing import Any

from simscen.advanced.prediction.motion_prediction import MotionPrediction
from simscen.advanced.recovery.costmap_clearing import ClearingBackoff
from simscen.advanced.replanning import AdvancedPlanManager
from simscen.advanced.stack import AdvancedStack
from simscen.advanced.turn_slip import TurnSlipObserver
from simscen.stack.build import StackBuilder
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.navigator import ClearEntirely, ClearingPolicy
from simscen.stack.plan_manager import PlanManager
from simscen.stack.protocols import Controller, Planner


class AdvancedStackBuilder(StackBuilder):
    """Builder of the advanced stack: replaces the plan manager, the clearing policy, and the stack itself."""

    def make_plan_manager(self, planner: Planner, costmaps: Costmaps, controller: Controller) -> PlanManager:
        """Make a plan manager that avoids moving obstacles at the full speed of the controller."""
        self._full_speed = controller.full_speed
        return AdvancedPlanManager(
            self.spec.planner,
            planner,
            costmaps.wide,
            self.plan_seed,
            self.robot.inscribed_radius,
            steered=self.robot.turning_radius > 0.0,
            latency=self.latency["planner"],
            speed=controller.full_speed,
        )

    def make_clearing_policy(self) -> ClearingPolicy:
        """Make the policy for clearing the global costmap."""
        return ClearEntirely() if self.spec.recovery.clear_entirely else ClearingBackoff()

    def make_stack(self, *parts: Any) -> AdvancedStack:
        """Make the stack of its components, with motion prediction and compensation of turn slip."""
        surroundings, spec = self.surroundings, self.spec
        prediction = MotionPrediction(
            spec.prediction, self.robot, surroundings.lidars, surroundings.tick_rate, self._full_speed
        )
        counters_slip = spec.localizer.fuses_odometry and spec.velocity_smoother.counter_turn_slip
        return AdvancedStack(*parts, prediction=prediction, turn_slip=TurnSlipObserver() if counters_slip else None)
