"""Search routes of the robot to goals and to areas that triggers wait for; the checks of a scene share the results."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.core.geometry.shapes import Solid
from simscen.loading.checks.scene import Scene
from simscen.loading.open_ground import extend_bounds
from simscen.loading.yaml.tree import Keys
from simscen.triggers.base import AnyCondition
from simscen.triggers.robot_state import RobotIn, RobotWithin
from simscen.worlds.routes.simple_paths import SimplePaths, simple_paths_between

if TYPE_CHECKING:
    from simscen.worlds.routes.shortest_paths import ShortestPaths


MAX_ROUTE_SILL_M = 0.03
"""Height of obstacles that a route may cross. For a start or goal, it is the lower SILL_M in scene.py."""


@dataclass(frozen=True)
class RobotRoutes:
    """Routes of a disc that fits into the footprint: if the disc has no route, neither has the robot.

    `stops` are the poses between which routes are needed: starts, goals, and the corners of trigger areas.
    """

    scene: Scene
    stops: tuple[Pose2, ...]

    def is_reachable(self, starts: Sequence[Pose2], goal: Pose2, solids: tuple[Solid, ...]) -> bool:
        """Return whether a route may lead from a start to the goal; False proves that there is none."""
        approximate = self._approximate_paths(solids)
        if approximate is not None and any(approximate.length(start[:2], goal[:2]) < float("inf") for start in starts):
            return True
        exact_paths = self._exact_paths(solids)
        return any(exact_paths.may_reach(start, goal) for start in starts)

    def can_enter(self, starts: Sequence[Pose2], towards: Pose2, distance: Callable[[Pose2], float]) -> bool:
        """Return whether the center of the robot can get from a start to a position where `distance` is at most 0."""
        approximate = self._approximate_paths(self.scene.world.solids)

        def is_inside(point: tuple[float, float]) -> bool:
            return distance(Pose2(*point)) <= 0

        if approximate is not None and any(
            approximate.can_enter(start[:2], towards[:2], is_inside) for start in starts
        ):
            return True
        return self._exact_paths(self.scene.world.solids).may_enter(starts, distance)

    def length_upper_bound(self, start: Pose2, goal: Pose2) -> float:
        """Return an upper bound of the shortest route in m; inf if the approximation finds none."""
        approximate = self._paths_around_fixed
        return float("inf") if approximate is None else approximate.length(start[:2], goal[:2])

    def length(self, start: Pose2, goal: Pose2) -> float:
        """Return the length of the shortest route around the fixed solids in m; inf if there is none."""
        return self._exact_paths(self.scene.world.solids).length(start, goal)

    @property
    def z_range(self) -> tuple[float, float]:
        """Heights in m between which an obstacle blocks a route."""
        return self.scene.heights_above(MAX_ROUTE_SILL_M)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounds of the world and of all stops, with room to drive around them."""
        return extend_bounds(self.scene.world.bounds, list(self.stops))

    @cached_property
    def _paths_around_fixed(self) -> SimplePaths | None:
        return self.scene.cache.simple_paths(self.scene.world.solids, self.scene.size.inscribed, self.z_range)

    def _approximate_paths(self, solids: tuple[Solid, ...]) -> SimplePaths | None:
        if solids is self.scene.world.solids:
            return self._paths_around_fixed
        return simple_paths_between(solids, self.scene.size.inscribed, self.z_range)

    def _exact_paths(self, solids: tuple[Solid, ...]) -> "ShortestPaths":
        return self.scene.cache.shortest_paths(solids, self.bounds, self.scene.size.inscribed, self.z_range)


class TriggerArea(NamedTuple):
    """An area that a trigger waits for the robot to enter.

    `keys` are the position of the condition in the scenario file, and `event` is the name of the event or fault.
    `distance` returns the distance in m of a pose from the area; it is at most 0 inside.
    """

    keys: Keys
    event: str
    description: str
    corners: Polygon
    distance: Callable[[Pose2], float]


def trigger_areas(scene: Scene) -> list[TriggerArea]:
    """Return the areas that the robot must enter before an event or a fault can start."""
    spec = scene.loaded.spec
    tests: list[tuple[Keys, str, AnyCondition | None]] = [
        ((*step.keys, "when"), step.name, step.when) for step in spec.steps
    ]
    tests += [(("faults", k, "when"), fault.label, fault.when) for k, fault in enumerate(spec.faults)]
    return [area for keys, name, test in tests if test is not None for area in _areas(scene, test, keys, name)]


def _areas(scene: Scene, test: AnyCondition, keys: Keys, name: str) -> Iterator[TriggerArea]:
    """Return the areas of all conditions that must be true for a test to be true."""
    if not scene.loaded.includes_robot(test.robot) or test.any is not None or test.not_ is not None:
        return
    if test.all is not None:
        for k, part in enumerate(test.all):
            yield from _areas(scene, part, (*keys, "all", k), name)
        return
    keys = (*keys, test.kind)
    match test.chosen if test.kind in ("robot_in", "robot_within") else None:
        case RobotIn(region=region):
            corners = scene.world.regions[region]
            yield TriggerArea(keys, name, f"region `{region}`", corners, _distance_to_region(corners, 0.0))
        case RobotWithin(region=str(region), distance=max_distance):
            corners = scene.world.regions[region]
            what = f"a position within {max_distance:g} m of region `{region}`"
            yield TriggerArea(keys, name, what, corners, _distance_to_region(corners, max_distance))
        case RobotWithin(of=[x, y], distance=max_distance):
            what = f"a position within {max_distance:g} m of ({x:g}, {y:g})"
            yield TriggerArea(keys, name, what, ((x, y),), lambda pose: pose.distance(Pose2(x, y)) - max_distance)
        case _:
            pass


def _distance_to_region(corners: Polygon, max_distance: float) -> Callable[[Pose2], float]:
    return lambda pose: distance_to_polygon(pose, corners) - max_distance


def robot_routes(scene: Scene) -> RobotRoutes:
    """Return the routes between the start, all goals and all trigger areas."""
    corners = [Pose2(x, y) for area in scene.cached(trigger_areas) for x, y in area.corners]
    return RobotRoutes(scene, (*scene.start_poses, *(goal.pose for _, goal in scene.targets), *corners))
