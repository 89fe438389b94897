"""Prepare a scenario for its runs: build what does not depend on the seed, such as world, map, and shortest paths."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial

from simscen.core.environment.costmap_filters import FilterMasks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Estimate
from simscen.core.records.case import CLEARANCE_RANGE_M, SINGLE_ROBOT_NAME, Case
from simscen.criteria.base import Criterion
from simscen.loading.builders import (
    load_criterion_masks,
    load_map,
    load_masks,
    load_robot,
    load_world,
    with_stops_in_bounds,
)
from simscen.loading.goals import event_goals, expected_failures, scenario_goals
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of
from simscen.loading.robot_size import blocking_solids
from simscen.model.localizers import OdometryOnly
from simscen.model.robot import RobotSpec
from simscen.model.scenario import ScenarioSpec, initial_estimate
from simscen.model.stack import StackSpec
from simscen.model.stack_files import AnyStack
from simscen.sim.body.robot_body import RobotBody
from simscen.spec.registry import RegisteredType
from simscen.triggers.robot_state import ClearanceBelow
from simscen.worlds.built_world import build_world_and_map
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.map_size import MAP_RESOLUTION_M, fitting_resolution
from simscen.worlds.routes.shortest_paths import Leg, legs_between

DEFAULT_LIDAR_HEIGHT_M = 0.2
"""Height above the ground at which the map of the world is made for a robot without a lidar."""


@dataclass(frozen=True, eq=False)
class PreparedScenario:
    """A scenario with its world, map, and robots: everything about a run except the seed.

    With several robots, all attributes except `loaded`, `plugins`, and `robots` are those of the first robot.

    Attributes:
        built: World with its mesh and its map.
        map: Map that the stack receives; None without a map.
        masks: Filter masks that the stack receives.
        robot: Specification of the robot.
        body: Physical model of the robot.
        stack: Specification of the stack.
        start: True initial pose in the world frame.
        estimate: Initial pose estimate that the stack receives.
        case: Facts that criteria need besides the log.
        obstacles: The part of the world's mesh that blocks the robot.
        map_faults: Indices of the faults of the scenario that have changed `map`; see `apply_map_faults`.
        plugins: Plug-ins that the scenario uses.
        robots: Prepared scenario of each of several robots by name; empty for a single robot.
    """

    loaded: LoadedScenario
    built: BuiltWorld
    map: OccupancyGrid | None
    masks: FilterMasks
    robot: RobotSpec
    body: RobotBody
    stack: AnyStack
    start: Pose2
    estimate: Estimate
    case: Case
    obstacles: TriangleMesh
    map_faults: tuple[int, ...] = ()
    plugins: tuple[RegisteredType, ...] = ()
    robots: Mapping[str, "PreparedScenario"] = field(default_factory=dict)

    @property
    def by_robot(self) -> Mapping[str, "PreparedScenario"]:
        """Prepared scenario of each robot by name. The name of a single robot is ""."""
        return self.robots or {SINGLE_ROBOT_NAME: self}

    @property
    def spec(self) -> ScenarioSpec:
        """Specification of the scenario."""
        return self.loaded.spec


BuildWorld = Callable[[LoadedScenario, float], BuiltWorld]
"""Function that builds the world of a scenario, and its map as seen by a lidar at a height in m."""

FindLegs = Callable[[BuiltWorld, Sequence[tuple[Pose2, Goal]], float], list[Leg]]
"""Function that returns the shortest path from each pose to its goal, for a disc with a radius in m."""


def build_world(loaded: LoadedScenario, height: float) -> BuiltWorld:
    """Build the world of a scenario, and its map as seen by a lidar at `height` m, without a cache."""
    world = with_stops_in_bounds(load_world(loaded), loaded)
    return build_world_and_map(world, height, map_resolution(loaded, world))


def lidar_height(robot: RobotSpec) -> float:
    """Return the height in m of the robot's first lidar, or DEFAULT_LIDAR_HEIGHT_M without a lidar."""
    heights = [sensor.lidar.mount.z for sensor in robot.sensors.values() if sensor.lidar]
    return heights[0] if heights else DEFAULT_LIDAR_HEIGHT_M


def map_resolution(loaded: LoadedScenario, world: World) -> float:
    """Return the cell size in m of the world's map. It is larger if the world is large and no robot uses the map."""
    is_used = any(view.map is None for view in loaded.robot_views.values())  # by robots without the key `map`
    return MAP_RESOLUTION_M if is_used else fitting_resolution(world.bounds)


def prepare(
    loaded: LoadedScenario, build: BuildWorld = build_world, find_legs: FindLegs = legs_between
) -> PreparedScenario:
    """Return the prepared scenario, with the world from `build` and the shortest paths from `find_legs`.

    Raises InvalidInput for unusable files.
    """
    build_once = cache(partial(build, loaded))  # the world is built once for each height of the robots' lidars
    if not loaded.robots:
        return _prepare_robot(loaded, build_once, find_legs)
    parts = {name: _prepare_robot(view, build_once, find_legs) for name, view in loaded.robots.items()}
    # The simulation measures the clearances of all robots up to the same distance.
    clearance_range = max(part.case.clearance_range for part in parts.values())
    parts = {
        name: replace(part, case=replace(part.case, clearance_range=clearance_range)) for name, part in parts.items()
    }
    return replace(next(iter(parts.values())), loaded=loaded, robots=parts, plugins=plugins_of(loaded))


def _prepare_robot(
    loaded: LoadedScenario, build: Callable[[float], BuiltWorld], find_legs: FindLegs
) -> PreparedScenario:
    """Prepare the scenario of one robot. `build` returns the world with its map at a height in m."""
    spec = loaded.spec
    robot, body = load_robot(loaded)
    built = build(lidar_height(robot))
    world = built.world
    blocking = blocking_solids(world.solids, body)
    obstacles = built.mesh if blocking is world.solids else merge_solids(blocking)
    start = spec.only_robot.pose.pose
    goals = scenario_goals(spec)
    case = Case(
        start=start,
        goals=goals,
        expected=expected_failures(spec, goals),
        sent=tuple(event_goals(loaded).values()),
        regions=world.regions,
        footprint=body.footprint,
        inscribed_radius=body.inscribed_radius,
        time_limit=spec.time_limit,
        clearance_range=_clearance_range(spec),
        disturbances=loaded.disturbances,
        masks=load_criterion_masks(loaded.criterion_masks, loaded.tree, loaded.sources),
    )
    return PreparedScenario(
        loaded=loaded,
        built=built,
        map=_robot_map(loaded, built),
        masks=load_masks(loaded),
        robot=robot,
        body=body,
        stack=_effective_stack(spec),
        start=start,
        estimate=initial_estimate(spec.only_robot, start),
        case=_with_shortest_paths(case, built, obstacles, find_legs),
        obstacles=obstacles,
        plugins=plugins_of(loaded),
    )


def _with_shortest_paths(case: Case, built: BuiltWorld, obstacles: TriangleMesh, find_legs: FindLegs) -> Case:
    """Return the case with the lengths of the shortest paths to its goals, and the narrow passages on these paths.

    The path to a goal starts at the previous goal that the robot is expected to reach, or at the initial pose.
    """
    starts_and_goals, pose = [], case.start
    for goal in case.goals:
        starts_and_goals.append((pose, goal))
        pose = pose if goal.name in case.expected else goal.pose  # `expected` has the goals that should fail
    legs = find_legs(replace(built, mesh=obstacles), starts_and_goals, case.inscribed_radius)
    return replace(
        case,
        shortest={goal.name: leg.length for goal, leg in zip(case.goals, legs, strict=True)},
        passages=tuple(passage for leg in legs for passage in leg.passages),
    )


def _clearance_range(spec: ScenarioSpec) -> float:
    """Return the largest clearance in m that a criterion or trigger uses, at least CLEARANCE_RANGE_M."""
    ranges = [entry.chosen.clearance_range for entry in spec.pass_ if isinstance(entry.chosen, Criterion)]
    conditions = (part.clearance_below for trigger in spec.triggers for part in trigger.walk())
    ranges += [condition.root for condition in conditions if isinstance(condition, ClearanceBelow)]
    return max([CLEARANCE_RANGE_M, *ranges])


def _robot_map(loaded: LoadedScenario, built: BuiltWorld) -> OccupancyGrid | None:
    """Return the map that the stack receives, or None if it receives none."""
    if loaded.map == "none":
        return None
    return load_map(loaded.map) if loaded.map is not None else built.map


def _effective_stack(spec: ScenarioSpec) -> AnyStack:
    """Return the stack of a scenario. Without a map, dead reckoning replaces the default localizer AMCL."""
    stack = spec.stack
    if isinstance(stack, StackSpec) and spec.map == "none" and stack.localizer.needs_map:
        is_default = "localizer" not in stack.model_fields_set
        return stack.model_copy(update={"localizer": OdometryOnly(type="odometry")}) if is_default else stack
    return stack
