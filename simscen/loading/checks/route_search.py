"""Route search for checks: routes of the robot to its goals and to the areas of triggers.

A fast approximate search runs first. If it finds no route, an exact search decides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from simscen.core.geometry import Polygon, Pose2
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.core.geometry.shapes import Solid
from simscen.loading.builders import extend_bounds
from simscen.loading.checks.scene import Scene
from simscen.loading.yaml.tree import Keys
from simscen.worlds.routes.simple_paths import SimplePaths

if TYPE_CHECKING:
    from simscen.triggers.base import AnyCondition
    from simscen.worlds.routes.shortest_paths import ShortestPaths


MAX_ROUTE_SILL_M = 0.03
"""Largest height of an obstacle that a route can cross."""


@dataclass(frozen=True)
class RobotRoutes:
    """Routes of the largest disc inside the robot's footprint. If the disc has no route, the robot has no route.

    `stops` are starts, goals, and corners of trigger areas. The obstacles are the `solids` of a method; the fixed
    solids of the world for methods without this parameter.
    """

    scene: Scene
    stops: tuple[Pose2, ...]

    def is_reachable(self, starts: Sequence[Pose2], goal: Pose2, solids: tuple[Solid, ...]) -> bool:
        """Return whether there may be a route from one of `starts` to the goal; False proves that there is none."""
        if any(self.length_upper_bound(start, goal, solids) < math.inf for start in starts):
            return True
        exact_paths = self._exact_paths(solids)
        return any(exact_paths.may_reach(start, goal) for start in starts)

    def can_enter(self, starts: Sequence[Pose2], towards: Pose2, distance: Callable[[Pose2], float]) -> bool:
        """Return whether there may be a route from one of `starts` into an area; False proves that there is none.

        `distance` returns the distance in m of a pose from the area; 0 or less inside. `towards` is a point in the area
        that guides the search.
        """
        approximate = self._approximate_paths(self.scene.world.solids)

        def is_inside(point: tuple[float, float]) -> bool:
            return distance(Pose2(*point)) <= 0

        if approximate and any(approximate.can_enter(start[:2], towards[:2], is_inside) for start in starts):
            return True
        return self._exact_paths(self.scene.world.solids).may_enter(starts, distance)

    def length_upper_bound(self, start: Pose2, goal: Pose2, solids: tuple[Solid, ...]) -> float:
        """Return an upper bound on the length of the shortest route in m, or inf if the fast search finds no route."""
        approximate = self._approximate_paths(solids)
        return math.inf if approximate is None else approximate.length(start[:2], goal[:2])

    def length(self, start: Pose2, goal: Pose2) -> float:
        """Return the length of the shortest route in m; inf if there is none."""
        return self._exact_paths(self.scene.world.solids).length(start, goal)

    @property
    def z_range(self) -> tuple[float, float]:
        """Lowest and highest z in m between which an obstacle blocks routes."""
        return self.scene.heights_above(MAX_ROUTE_SILL_M)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounds of the world extended to all stops: (min x, min y, max x, max y) in m."""
        return extend_bounds(self.scene.world.bounds, list(self.stops))

    def _approximate_paths(self, solids: tuple[Solid, ...]) -> SimplePaths | None:
        """Return the fast path search between `solids`; None if a solid is too complex for it."""
        return self.scene.cache.simple_paths(solids, self.scene.size.inscribed_radius, self.z_range)

    def _exact_paths(self, solids: tuple[Solid, ...]) -> ShortestPaths:
        return self.scene.cache.shortest_paths(solids, self.bounds, self.scene.size.inscribed_radius, self.z_range)


class TriggerArea(NamedTuple):
    """Area that the robot must enter before an event or fault can start."""

    keys: Keys
    """Keys of the condition in the scenario."""
    event: str
    """Name of the event or fault."""
    description: str
    """Description of the area for messages."""
    corners: Polygon
    """Corners (x, y) in m of the region, or the center of a circle."""
    distance: Callable[[Pose2], float]
    """Function that returns the distance in m of a pose from the area; 0 or less inside."""
    is_required: bool = True
    """Whether the run fails if the event or fault never happens."""


def trigger_areas(scene: Scene) -> list[TriggerArea]:
    """Return the areas that the robot must enter before events and faults can start."""
    spec = scene.loaded.spec
    conditions: list[tuple[Keys, str, AnyCondition | None, bool]] = [
        ((*step.keys, "when"), step.name, step.when, step.required) for step in spec.steps
    ]
    for k, fault in enumerate(spec.faults):
        conditions.append((("faults", k, "when"), fault.label, fault.when, fault.required))
    return [
        area._replace(is_required=is_required)
        for keys, name, condition, is_required in conditions
        if condition is not None
        for area in _required_areas(scene, condition, keys, name)
    ]


def _required_areas(scene: Scene, condition: AnyCondition, keys: Keys, name: str) -> Iterator[TriggerArea]:
    """Yield the areas that the robot must enter before a condition of the event or fault `name` can be true."""
    if not scene.loaded.includes_robot(condition.robot) or condition.any is not None or condition.not_ is not None:
        return
    if condition.all is not None:
        for k, part in enumerate(condition.all):
            yield from _required_areas(scene, part, (*keys, "all", k), name)
        return
    keys = (*keys, condition.kind)
    if condition.kind not in ("robot_in", "robot_within"):
        return
    spec = condition.chosen
    max_distance = 0.0 if condition.kind == "robot_in" else spec.distance
    near = f"a position within {max_distance:g} m of " if condition.kind == "robot_within" else ""
    if spec.region is not None:
        corners = scene.world.regions[spec.region]
        area = f"{near}region `{spec.region}`"
        yield TriggerArea(keys, name, area, corners, lambda pose: distance_to_polygon(pose, corners) - max_distance)
    elif isinstance(spec.of, list):
        x, y = spec.of
        area = f"{near}({x:g}, {y:g})"
        yield TriggerArea(keys, name, area, ((x, y),), lambda pose: pose.distance(Pose2(x, y)) - max_distance)


def robot_routes(scene: Scene) -> RobotRoutes:
    """Return the routes between the start, all goals, and all trigger areas of a scene."""
    corners = [Pose2(x, y) for area in scene.cached(trigger_areas) for x, y in area.corners]
    return RobotRoutes(scene, (*scene.start_poses, *(goal.pose for _, goal in scene.expected_goals), *corners))
