"""From a specification to a stack."""

from collections.abc import Callable
from dataclasses import replace

from simscen.advanced.prediction.motion_prediction import MotionPrediction
from simscen.advanced.recovery.costmap_clearing import ClearingBackoff
from simscen.core.clock import Clock
from simscen.core.messages.goal_names import Mode
from simscen.core.random_streams import Streams
from simscen.model.latency import Latency
from simscen.model.recovery import Recovery
from simscen.model.stack import InProcessStack, StackSpec
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.commands import Commands
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.installed.behavior import InstalledBehavior
from simscen.stack.installed.controller import InstalledController
from simscen.stack.installed.goal_checker import InstalledGoalChecker
from simscen.stack.installed.localizer import InstalledLocalizer
from simscen.stack.installed.planner import InstalledPlanner
from simscen.stack.installed.stack import InstalledStack
from simscen.stack.installed.watched import made
from simscen.stack.navigator import Navigator
from simscen.stack.odometry_history import WAY, OdometryHistory
from simscen.stack.plan_manager import PlanManager
from simscen.stack.progress_checker import ProgressChecker
from simscen.stack.protocols import Behavior, Controller, Localizer, Surroundings
from simscen.stack.recovery import RoundRobin
from simscen.stack.reference import ReferenceStack
from simscen.stack.setting import Setting
from simscen.stack.tasks import Task
from simscen.stack.velocity_smoother import VelocitySmoother


def build_stack(
    spec: InProcessStack,
    surroundings: Surroundings,
    streams: Streams,
    clock: Clock,
    *,
    stop_on_failure: bool = True,
    heard: Callable[[Localizer], Localizer] = lambda localizer: localizer,
    mode: Mode = "navigate_to_pose",
) -> InstalledStack:
    """The stack of a specification, ready to `start`. Raises ValueError when a rate does not divide the clock.

    `heard` makes of its localizer the one that the rest of a reference stack asks.
    """
    period = clock.seconds(clock.period(spec.controller_frequency))
    setting = Setting(
        surroundings, "stack", streams, control_period=period, stop_on_failure=stop_on_failure, mode=mode, heard=heard
    )
    return InstalledStack(spec, setting)


def reference_stack(spec: StackSpec, setting: Setting) -> ReferenceStack:
    """Nav2 in miniature. It works on its map in cells no larger than the costmap's.

    Its random streams are "localizer", "controller" and "planner#1", "planner#2", … for the plans of a run; components
    of others have theirs besides, so that one more of them changes nobody's numbers.
    """
    surroundings, clock, streams = setting.surroundings, setting.clock, setting.streams
    if surroundings.map is not None:
        surroundings = replace(surroundings, map=surroundings.map.refined(spec.costmap.resolution))
    robot, period = surroundings.robot, clock.period(spec.controller_frequency)
    latency = _ticks(spec, clock)
    odometry = OdometryHistory(surroundings.tick_rate, way=WAY)
    driving = replace(
        setting,
        surroundings=surroundings,
        name="controller",
        resolution=spec.local_costmap.completed(spec.costmap).resolution,
        way=odometry.way,
    )
    controller: Controller = made(InstalledController, spec.controller, driving)
    costmaps = Costmaps(spec, surroundings, controller.full_speed * spec.controller.looks_ahead, latency["costmap"])
    monitor = CollisionMonitor(spec.collision_monitor, robot, surroundings.lidars, surroundings.tick_rate)
    driving = replace(driving, clear_costmap=costmaps.clear, clear_around=costmaps.clear_around, allowed=monitor.allow)
    planning = replace(driving, name="planner", resolution=costmaps.wide.view.resolution)
    plans = PlanManager(
        spec.planner,
        InstalledPlanner(spec.planner, planning),
        costmaps.wide,
        lambda number: streams.integer(f"planner#{number}"),
        robot.inscribed_radius,
        steered=robot.turning_radius > 0.0,
        latency=latency["planner"],
        speed=controller.full_speed,
    )
    navigator = Navigator(
        plans,
        controller,
        RoundRobin(_behaviors(spec.recovery, driving), spec.recovery),
        made(InstalledGoalChecker, spec.goal_checker, driving.named("goal_checker")),
        ProgressChecker(spec.progress_checker),
        costmaps,
        setting.control_period,
        spec.failure_tolerance,
        ClearingBackoff(always=spec.recovery.clear_entirely),
    )
    commands = Commands(
        VelocitySmoother(spec.velocity_smoother, robot, setting.control_period),
        monitor,
        period,
        (latency["controller"], latency["collision_monitor"]),
    )
    return ReferenceStack(
        surroundings,
        setting.heard(made(InstalledLocalizer, spec.localizer, driving.named("localizer"))),
        costmaps,
        controller,
        navigator,
        Task(setting.stop_on_failure, clock=clock, mode=setting.mode),
        commands,
        monitor,
        MotionPrediction(spec.prediction, robot, surroundings.lidars, surroundings.tick_rate, controller.full_speed),
        odometry,
        period,
        latency["localizer"],
        spec.localizer.fuses_odometry,
        spec.velocity_smoother.counter_turn_slip,
    )


def _ticks(spec: StackSpec, clock: Clock) -> dict[str, int]:
    """What each part takes in whole ticks; the robot's own values have been put in by whoever knows its file."""
    latency = spec.latency if isinstance(spec.latency, Latency) else Latency()
    return {part: clock.ticks(getattr(latency, part)) for part in Latency.model_fields}


def _behaviors(spec: Recovery, shared: Setting) -> list[Behavior]:
    """The recovery behaviours that the robot can do, each with a random stream of its own."""
    possible = [each for each in spec.chosen() if shared.robot.turning_radius == 0.0 or not each.turns_in_place]
    return [
        InstalledBehavior(each, shared.named(f"behavior#{number}")) for number, each in enumerate(possible, start=1)
    ]
