"""From a specification to a stack."""

import math
from dataclasses import replace

import numpy as np
from typing_extensions import assert_never

from simscen.core.belief import Estimate
from simscen.core.chance import Streams
from simscen.core.events import Event
from simscen.core.time import Clock
from simscen.model import stack as model
from simscen.stack.behaviors.motions import BackUp, ClearCostmap, Spin, Wait
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.controllers.dwb import DynamicWindowController
from simscen.stack.controllers.mppi import MppiController
from simscen.stack.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.footprint import Footprint
from simscen.stack.goal_checker import GoalChecker
from simscen.stack.localizers.build import build_localizer
from simscen.stack.navigator import Navigator
from simscen.stack.plan_keeper import PlanKeeper
from simscen.stack.planners.build import build_planner
from simscen.stack.progress_checker import ProgressChecker
from simscen.stack.protocols import Behavior, Controller, RobotModel, Stack, Surroundings
from simscen.stack.recovery import RoundRobin
from simscen.stack.reference import ReferenceStack
from simscen.stack.tasks import Task
from simscen.stack.velocity_smoother import VelocitySmoother


def build_stack(
    spec: model.StackSpec,
    surroundings: Surroundings,
    streams: Streams,
    clock: Clock,
    *,
    stop_on_failure: bool = True,
) -> Stack:
    """The stack of a specification, ready to `start`. It works on its map in cells no larger than the costmap's.

    Its random streams are "localizer", "controller" and "planner#1", "planner#2", … for the plans of a run. Raises
    ValueError when a rate does not divide the clock.
    """
    if surroundings.map is not None:
        surroundings = replace(surroundings, map=surroundings.map.refined(spec.costmap.resolution))
    robot = surroundings.robot
    period = clock.period(spec.controller_frequency)
    seconds = clock.seconds(period)
    journal: list[Event] = []
    costmap = Costmap(spec.costmap, surroundings)
    footprint = Footprint(robot, costmap.view.resolution)
    controller = build_controller(spec.controller, robot, footprint, seconds, streams.generator("controller"))
    localizer = build_localizer(spec.localizer, surroundings, Estimate(None), streams.generator("localizer"))
    plans = PlanKeeper(
        spec.planner,
        build_planner(spec.planner, robot, footprint),
        controller,
        costmap,
        lambda number: streams.integer(f"planner#{number}"),
        robot.inscribed_radius,
        journal,
        steered=robot.turning_radius > 0.0,
    )
    navigator = Navigator(
        plans,
        controller,
        RoundRobin(_behaviors(spec.recovery, robot, footprint, costmap), spec.recovery.number_of_retries),
        GoalChecker(spec.goal_checker.stateful),
        ProgressChecker(spec.progress_checker),
        costmap,
        seconds,
        journal,
    )
    return ReferenceStack(
        surroundings,
        localizer,
        costmap,
        controller,
        navigator,
        Task(stop_on_failure, journal),
        VelocitySmoother(spec.velocity_smoother, robot, seconds),
        CollisionMonitor(spec.collision_monitor, robot, surroundings.lidars, surroundings.tick_rate),
        period,
        math.ceil(surroundings.tick_rate / spec.costmap.update_frequency),
        journal,
    )


def build_controller(
    spec: model.Controller, robot: RobotModel, footprint: Footprint, period: float, chance: np.random.Generator
) -> Controller:
    """The controller of a specification, called every `period` seconds; `chance` is its own random stream."""
    match spec:
        case model.RegulatedPurePursuit():
            return RegulatedPurePursuit(spec, robot, footprint, period)
        case model.DynamicWindow():
            return DynamicWindowController(spec, robot, footprint, period)
        case model.Mppi():
            return MppiController(spec, robot, footprint, period, chance)
        case _:
            assert_never(spec)


def _behaviors(spec: model.Recovery, robot: RobotModel, footprint: Footprint, costmap: Costmap) -> list[Behavior]:
    known: dict[str, Behavior] = {
        "clear_costmap": ClearCostmap(costmap.clear),
        "spin": Spin(spec, robot, footprint),
        "wait": Wait(spec),
        "backup": BackUp(spec, robot, footprint),
    }
    return [known[name] for name in spec.behaviors if name != "spin" or robot.turning_radius == 0.0]
