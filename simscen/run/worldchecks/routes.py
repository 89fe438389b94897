"""Which ways a robot has before anything happens: first in plain numbers, exactly only where those do not settle it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from simscen.core.geometry import Pose2
from simscen.core.shapes import Solid
from simscen.run.worldcache import WorldCache, around
from simscen.run.worldchecks.scene import Scene
from simscen.worlds.plainways import PlainWays, plain_ways

if TYPE_CHECKING:
    from simscen.worlds.shortest import ShortestWays

SILL = 0.03
"""Metres: what is lower may be driven over, which a way may do where no robot could stop."""


@dataclass(frozen=True)
class RobotRoutes:
    """The ways of a disc that fits into the robot's footprint: where that finds none, the robot has none."""

    scene: Scene
    cache: WorldCache
    stops: tuple[Pose2, ...]

    def lead(self, starts: Sequence[Pose2], goal: Pose2, solids: tuple[Solid, ...]) -> bool:
        """Whether a way may lead from one of the starts to the goal; False is a proof that there is none."""
        plain = self._plain(solids)
        if plain is not None and any(plain.length(start[:2], goal[:2]) < float("inf") for start in starts):
            return True
        exact = self._exact(solids)
        return any(exact.may_reach(start, goal) for start in starts)

    def come_to(self, starts: Sequence[Pose2], towards: Pose2, distance: Callable[[Pose2], float]) -> bool:
        """Whether the robot's middle may come from a start to where `distance` is 0, past the fixed solids."""
        plain = self._plain(self.scene.world.solids)

        def arrived(point: tuple[float, float]) -> bool:
            return distance(Pose2(*point)) <= 0

        if plain is not None and any(plain.comes_to(start[:2], towards[:2], arrived) for start in starts):
            return True
        return self._exact(self.scene.world.solids).may_come_to(starts, distance)

    def longest(self, start: Pose2, goal: Pose2) -> float:
        """Metres that the shortest way has at most; inf where plain numbers do not tell."""
        plain = self._fixed
        return float("inf") if plain is None else plain.length(start[:2], goal[:2])

    def shortest(self, start: Pose2, goal: Pose2) -> float:
        """Metres of the shortest way past the fixed solids; inf where none is found."""
        return self._exact(self.scene.world.solids).length(start, goal)

    @property
    def z_range(self) -> tuple[float, float]:
        """Between which heights a way is closed."""
        return SILL, max(2 * SILL, self.scene.size.height)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Of all that a way may lead around."""
        return around(self.scene.world.bounds, list(self.stops))

    @cached_property
    def _fixed(self) -> PlainWays | None:
        return self.cache.plain_ways(self.scene.world.solids, self.scene.size.inscribed, self.z_range)

    def _plain(self, solids: tuple[Solid, ...]) -> PlainWays | None:
        if solids is self.scene.world.solids:
            return self._fixed
        return plain_ways(solids, self.scene.size.inscribed, self.z_range)

    def _exact(self, solids: tuple[Solid, ...]) -> "ShortestWays":
        return self.cache.ways(solids, self.bounds, self.scene.size.inscribed, self.z_range)
