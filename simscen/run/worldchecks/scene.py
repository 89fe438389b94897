"""Where a robot can be at all: on the map that it gets, or in the world."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydantic import BaseModel

from simscen.core.geometry import Pose2
from simscen.core.grid import OccupancyGrid
from simscen.core.navigation import Goal
from simscen.core.shapes import Body, Solid
from simscen.core.world import Polygon, World
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Key
from simscen.run.goals import goals_of, sent_goals
from simscen.run.robotsize import RobotSize
from simscen.run.worldchecks.expected_failures import expects_failure
from simscen.run.worldsource import load_map
from simscen.worlds.contain import first_blocking
from simscen.worlds.overlap import first_overlapping
from simscen.worlds.upright import upright


@dataclass(frozen=True)
class DrivableArea:
    """Without a map the ground goes on beyond the obstacles: BARN's goals lie there."""

    bounds: tuple[float, float, float, float] | None = None
    grid: OccupancyGrid | None = None

    def outside(self, pose: Pose2) -> str | None:
        """What a place is outside of, in words that follow "is"; None on the ground."""
        if self.grid is not None and not self.grid.inside(self.grid.cell_of(np.array([[pose.x, pose.y]])))[0]:
            rows, columns = self.grid.shape
            size = f"{columns * self.grid.resolution:g} m x {rows * self.grid.resolution:g} m"
            return f"outside the map ({size} from ({self.grid.origin.x:g}, {self.grid.origin.y:g}))"
        if self.bounds is None:
            return None
        left, bottom, right, top = self.bounds
        if left <= pose.x <= right and bottom <= pose.y <= top:
            return None
        return f"outside the world ({left:g} … {right:g}, {bottom:g} … {top:g})"


def drivable_area(loaded: LoadedScenario, world: World) -> DrivableArea:
    """The map that the robot gets, which for a world without one covers all that is in it."""
    if loaded.map == "none":
        return DrivableArea()
    grid = world.grid if loaded.map is None else load_map(loaded.map)
    return DrivableArea(world.bounds if grid is None else None, grid)


# MERGED: A scenario in its world, with the room that its robot takes: what the checks before a run look at.
SILL = 0.02
"""Metres: what is lower is not in a robot's way."""
CIRCLE_EDGE = 1e-6
Keys = tuple[Key, ...]


@dataclass(frozen=True)
class Scene:
    """All that is known before a run."""

    loaded: LoadedScenario
    world: World
    size: RobotSize

    @property
    def z_range(self) -> tuple[float, float]:
        """Between which heights something is in the robot's way."""
        return SILL, max(2 * SILL, self.size.height)

    @cached_property
    def start(self) -> Pose2:
        """Where the robot truly stands at first."""
        return self.loaded.spec.own.pose.pose

    @cached_property
    def ground(self) -> DrivableArea:
        """Where the robot can be at all."""
        return drivable_area(self.loaded, self.world)

    @cached_property
    def standing(self) -> tuple[Solid, ...]:
        """What can move, where it is at first, by the names that scenarios know."""
        return tuple(_placed(self.world.bodies))

    @cached_property
    def staying(self) -> tuple[Solid, ...]:
        """What could move but never does: nothing opens, moves or removes it, and the robot cannot push it."""
        return tuple(
            _placed(b for b in self.world.bodies if b.mass == 0 and b.path is None and b.name not in self._moved)
        )

    @cached_property
    def lying(self) -> tuple[Solid, ...]:
        """What can move but is left alone: it neither goes by itself, nor does an event open, move or remove it."""
        return tuple(_placed(b for b in self.world.bodies if b.path is None and b.name not in self._moved))

    @cached_property
    def _moved(self) -> set[str]:
        if self.does():
            return {body.name for body in self.world.bodies}
        return {getattr(action, "name", "") for _, kind, action in self.actions if kind in MOVING}

    @cached_property
    def certain(self) -> tuple[Solid, ...]:
        """The fixed solids that are walls to a robot for sure: upright ones, and the walls made of a map.

        A mesh or a tilted box may be a ramp.
        """
        mapped = self.world.grid is not None
        return tuple(s for s in self.world.solids if upright(s) is not None or (mapped and s.name == "map"))

    @cached_property
    def targets(self) -> list[tuple[Keys, Goal]]:
        """The goals that are to be reached, also those that events send, each with where its pose stands."""
        spec = self.loaded.spec
        first = goals_of(spec)[: len(spec.goals)]  # further loops lead to the same places
        own: dict[Keys, Goal] = {("goals", k): goal for k, goal in enumerate(first)}
        every = {**own, **sent_goals(spec, self.loaded.concerns)}
        return [((*keys, "pose"), goal) for keys, goal in every.items() if not expects_failure(spec, goal.name)]

    @cached_property
    def actions(self) -> list[tuple[Keys, str, BaseModel]]:
        """Every action of every event: where it stands in the file, its kind, and what it says."""
        placed = [found for step in self.loaded.spec.steps for found in step.placed()]
        mine = [(keys, action) for keys, action in placed if self.loaded.concerns(action.robot)]
        return [((*keys, action.kind), action.kind, action.chosen) for keys, action in mine]

    def does(self, *kinds: str) -> bool:
        """Whether an event of the scenario does, or may do, any of these; of none: whether one may do anything."""
        return any(action.may(*kinds) for step in self.loaded.spec.steps for action in step.actions)

    def footprint_at(self, pose: Pose2, solids: Iterable[Solid]) -> str | None:
        """Which of the solids the robot's own footprint would overlap, as words that follow "is"; None for none."""
        if solid := first_blocking(solids, (pose.x, pose.y), CIRCLE_EDGE, self.z_range):
            return f'inside obstacle "{solid}"'
        if solid := self.circle_at(pose, solids):
            return f'nearer to obstacle "{solid}" than the robot\'s {self._radius} of {self.size.inscribed:.2f} m'
        if self.size.radius is None and (solid := first_overlapping(solids, self.outline, pose, self.z_range)):
            return f'so near to obstacle "{solid}" that the robot\'s footprint, turned as it is there, would overlap it'
        return None

    def circle_at(self, pose: Pose2, solids: Iterable[Solid]) -> str | None:
        """Which of the solids the circle inside the robot's footprint would overlap, however it is turned."""
        return first_blocking(solids, (pose.x, pose.y), self.size.inscribed, self.z_range)

    @property
    def outline(self) -> Polygon:
        """The footprint in the robot's own frame."""
        return self.size.footprint

    @property
    def _radius(self) -> str:
        return "radius" if self.size.radius is not None else "inscribed radius"


MOVING = frozenset({"open", "close", "move", "remove", "teleport", "push"})
"""Actions after which a thing is no longer where it was."""


def _placed(bodies: Iterable[Body]) -> Iterator[Solid]:
    for body in bodies:
        for solid in body.solids:
            yield Solid(solid.shape, body.pose.compose(solid.pose), body.name)
