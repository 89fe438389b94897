"""Routes of a robot through the fixed world, first with a fast approximation, then exactly if that does not decide."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Solid
from simscen.run.caching.world_cache import bounds_with
from simscen.run.worldchecks.scene import Scene
from simscen.worlds.routes.simple_paths import SimplePaths, simple_paths_between

if TYPE_CHECKING:
    from simscen.worlds.routes.shortest_paths import ShortestPaths

SILL_M = 0.03
"""Height of obstacles that a route may cross, although no robot could stop there."""


@dataclass(frozen=True)
class RobotRoutes:
    """Routes of a disc that fits into the footprint: if the disc has no route, neither has the robot."""

    scene: Scene
    stops: tuple[Pose2, ...]

    def is_reachable(self, starts: Sequence[Pose2], goal: Pose2, solids: tuple[Solid, ...]) -> bool:
        """Return whether a route may lead from a start to the goal; False proves that there is none."""
        plain = self._plain(solids)
        if plain is not None and any(plain.length(start[:2], goal[:2]) < float("inf") for start in starts):
            return True
        exact = self._exact(solids)
        return any(exact.may_reach(start, goal) for start in starts)

    def can_come_to(self, starts: Sequence[Pose2], towards: Pose2, distance: Callable[[Pose2], float]) -> bool:
        """Return whether the center of the robot can get from a start to where `distance` is at most 0."""
        plain = self._plain(self.scene.world.solids)

        def arrived(point: tuple[float, float]) -> bool:
            return distance(Pose2(*point)) <= 0

        if plain is not None and any(plain.comes_to(start[:2], towards[:2], arrived) for start in starts):
            return True
        return self._exact(self.scene.world.solids).may_come_to(starts, distance)

    def length_upper_bound(self, start: Pose2, goal: Pose2) -> float:
        """Return an upper bound of the shortest route in m; inf if the approximation finds none."""
        plain = self._fixed
        return float("inf") if plain is None else plain.length(start[:2], goal[:2])

    def length(self, start: Pose2, goal: Pose2) -> float:
        """Return the length of the shortest route around the fixed solids in m; inf if there is none."""
        return self._exact(self.scene.world.solids).length(start, goal)

    @property
    def z_range(self) -> tuple[float, float]:
        """Heights in m between which an obstacle blocks a route."""
        return SILL_M, max(2 * SILL_M, self.scene.size.height)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounds of the world and of all stops, with room to drive around them."""
        return bounds_with(self.scene.world.bounds, list(self.stops))

    @cached_property
    def _fixed(self) -> SimplePaths | None:
        return self.scene.cache.plain_ways(self.scene.world.solids, self.scene.size.inscribed, self.z_range)

    def _plain(self, solids: tuple[Solid, ...]) -> SimplePaths | None:
        if solids is self.scene.world.solids:
            return self._fixed
        return simple_paths_between(solids, self.scene.size.inscribed, self.z_range)

    def _exact(self, solids: tuple[Solid, ...]) -> "ShortestPaths":
        return self.scene.cache.ways(solids, self.bounds, self.scene.size.inscribed, self.z_range)
