"""Functions and a class that build the reference stack and its components from a specification."""

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

from simscen.core.clock import Clock
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Mode
from simscen.core.random_streams import Streams
from simscen.model.recovery import Recovery
from simscen.model.stack import InProcessStack, StackSpec
from simscen.model.stack_base import Latency
from simscen.stack.behaviors import BehaviorSequence
from simscen.stack.checkers import ProgressChecker
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.commands import CommandPipeline, VelocitySmoother
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.navigator import ClearingPolicy, Navigator
from simscen.stack.odometry_history import TRAIL_S, OdometryHistory
from simscen.stack.plan_manager import PlanManager
from simscen.stack.protocols import Behavior, Controller, Localizer, Surroundings
from simscen.stack.reference import ReferenceStack
from simscen.stack.setting import Setting
from simscen.stack.tasks import Task
from simscen.stack.validation.components import (
    CheckedBehavior,
    CheckedController,
    CheckedGoalChecker,
    CheckedLocalizer,
    CheckedPlanner,
    build_component,
)
from simscen.stack.validation.stack import CheckedStack

if TYPE_CHECKING:
    from simscen.stack.localizers.odometry_filter import OdometryFilter


def build_stack(
    spec: InProcessStack,
    surroundings: Surroundings,
    streams: Streams,
    clock: Clock,
    *,
    stop_on_failure: bool = True,
    wrap_localizer: Callable[[Localizer], Localizer] = lambda localizer: localizer,
    mode: Mode = "navigate_to_pose",
) -> CheckedStack:
    """Build a stack from its specification, and return it in a wrapper that validates its decisions.

    `wrap_localizer` returns a wrapper of the localizer, for example a wrapper that injects faults. The other components
    use the wrapper. Raises ValueError if `controller_frequency` does not divide the tick rate.
    """
    period = clock.seconds(clock.period(spec.controller_frequency))
    setting = Setting(
        surroundings,
        "stack",
        streams,
        control_period=period,
        stop_on_failure=stop_on_failure,
        mode=mode,
        wrap_localizer=wrap_localizer,
    )
    return CheckedStack(spec, setting)


def configured_stack(spec: StackSpec, setting: Setting) -> ReferenceStack:
    """Build a reference or an advanced stack with the StackBuilder class that `spec.builder` names."""
    module, _, name = spec.builder.partition(":")
    stack: ReferenceStack = getattr(import_module(module), name)(spec, setting).build()
    return stack


class StackBuilder:
    """Builder of the reference stack. Subclasses override `plan_manager` and methods `make_…` to replace components.

    Each component has its own random stream, for example "localizer". Each plan has its own random seed.

    surroundings:  surroundings of the stack; the map has cells no larger than those of the costmap
    latency:       latency in ticks by component, for example "planner"
    full_speed:    maximum speed of the controller in m/s; set by `build`
    """

    plan_manager: ClassVar[type[PlanManager]] = PlanManager
    """Class of the plan manager."""

    def __init__(self, spec: StackSpec, setting: Setting) -> None:
        surroundings = setting.surroundings
        if surroundings.map is not None:
            surroundings = replace(surroundings, map=surroundings.map.refined(spec.costmap.resolution))
        self.spec, self.setting, self.surroundings = spec, setting, surroundings
        self.robot, self.streams = surroundings.robot, setting.streams
        latency = spec.latency if isinstance(spec.latency, Latency) else Latency()
        self.latency = {name: setting.clock.ticks(getattr(latency, name)) for name in Latency.model_fields}

    def build(self) -> ReferenceStack:
        """Build all components and the stack."""
        spec, setting, robot = self.spec, self.setting, self.robot
        period = setting.clock.period(spec.controller_frequency)
        odometry = OdometryHistory(self.surroundings.tick_rate, trail_s=TRAIL_S)
        control_setting = replace(
            setting,
            surroundings=self.surroundings,
            name="controller",
            resolution=spec.local_costmap.with_defaults_from(spec.costmap).resolution,
            trail=odometry.trail,
        )
        controller: Controller = build_component(CheckedController, spec.controller, control_setting)
        self.full_speed = controller.full_speed
        lookahead_distance = self.full_speed * spec.controller.lookahead_s
        costmaps = Costmaps(spec, self.surroundings, lookahead_distance, self.latency["costmap"])
        monitor = CollisionMonitor(spec.collision_monitor, robot, self.surroundings.lidars, self.surroundings.tick_rate)
        control_setting = replace(
            control_setting,
            clear_costmap=costmaps.clear,
            clear_around=costmaps.clear_around,
            limit_command=monitor.limit_command,
        )
        global_resolution = costmaps.global_costmap.view.resolution
        planner_setting = replace(control_setting, name="planner", resolution=global_resolution)
        plans = self.plan_manager(
            spec.planner,
            CheckedPlanner(spec.planner, planner_setting),
            costmaps.global_costmap,
            self.plan_seed,
            robot.inscribed_radius,
            robot.turning_radius > 0.0,
            self.latency["planner"],
            self.full_speed,
        )
        navigator = Navigator(
            plans,
            controller,
            BehaviorSequence(_build_behaviors(spec.recovery, control_setting), spec.recovery),
            build_component(CheckedGoalChecker, spec.goal_checker, control_setting.named("goal_checker")),
            ProgressChecker(spec.progress_checker),
            costmaps,
            setting.control_period,
            spec.failure_tolerance,
            Twist(spec.min_x_velocity_threshold, spec.min_y_velocity_threshold, spec.min_theta_velocity_threshold),
            self.make_clearing_policy(),
        )
        commands = CommandPipeline(
            VelocitySmoother(spec.velocity_smoother, robot, setting.control_period),
            monitor,
            period,
            (self.latency["controller"], self.latency["collision_monitor"]),
        )
        localizer = build_component(CheckedLocalizer, spec.localizer, control_setting.named("localizer"))
        return self.make_stack(
            self.surroundings,
            setting.wrap_localizer(localizer),
            costmaps,
            controller,
            navigator,
            Task(setting.stop_on_failure, clock=setting.clock, mode=setting.mode),
            commands,
            monitor,
            odometry,
            period,
            self.latency["localizer"],
            spec.localizer.fuses_odometry,
            self.make_odometry_filter(),
        )

    def plan_seed(self, number: int) -> int:
        """Return the random seed of the plan with this number in the run (1, 2, …)."""
        return self.streams.library_seed(f"planner#{number}")

    def make_odometry_filter(self) -> "OdometryFilter | None":
        """Return a filter that fuses wheel odometry and IMU; None if the stack uses unfiltered wheel odometry."""
        if not self.spec.filters_odometry(self.surroundings.has_imu):
            return None
        from simscen.stack.localizers.odometry_filter import OdometryFilter

        return OdometryFilter(self.spec.odometry, self.surroundings.tick_rate)

    def make_clearing_policy(self) -> ClearingPolicy:
        """Return the policy that decides how much of the global costmap is cleared when planning has failed."""
        return ClearingPolicy()

    def make_stack(self, *arguments: Any) -> ReferenceStack:
        """Call the constructor of the stack with these arguments."""
        return ReferenceStack(*arguments)


def _build_behaviors(spec: Recovery, setting: Setting) -> list[Behavior]:
    """Build the recovery behaviors that the robot can execute, each with its own random stream."""
    can_turn = setting.robot.turning_radius == 0.0
    possible = [each for each in spec.behavior_specs() if can_turn or not each.turns_in_place]
    return [CheckedBehavior(each, setting.named(f"behavior#{number}")) for number, each in enumerate(possible, start=1)]
