"""Scene: a scenario of one robot in its built world, the subject of the check stages WORLD and TIMING."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Body, Solid
from simscen.core.messages.goals import Goal
from simscen.loading.builders import load_map
from simscen.loading.goals import event_goals, expects_failure, scenario_goals
from simscen.loading.loaded import LoadedScenario
from simscen.loading.robot_size import RobotSize
from simscen.loading.world_cache import WorldCache
from simscen.loading.yaml.tree import Keys
from simscen.worlds.geometry.overlaps import first_solid_in_disc, first_solid_in_footprint
from simscen.worlds.geometry.prisms import upright_prism

SILL_M = 0.02
"""Height below which an obstacle does not block the start or a goal of a robot on wheels."""
MIN_HULL_OVERLAP_M = 0.002
"""Height above the underside of a hull that an obstacle must reach to touch the hull."""
TOUCH_M = 1e-6
"""Distance below which a point counts as inside a solid."""
START = ("robot", "pose")
"""Keys of the start pose in a scenario of one robot."""
MOVING_ACTIONS = frozenset({"open", "close", "move", "remove", "spawn", "teleport", "push"})
"""Kinds of actions that can move, remove, or replace a body."""

T = TypeVar("T")


@dataclass(frozen=True)
class Scene:
    """Scenario of one robot, or the view of one of several robots, in the built world.

    `world` contains only the solids that block the robot. Positions are in m in the frame of the world. `cache` keeps
    path searches for further scenes.
    """

    loaded: LoadedScenario
    world: World
    size: RobotSize
    cache: WorldCache = field(default_factory=WorldCache, repr=False)
    _results: dict[Callable[..., Any], Any] = field(default_factory=dict, repr=False, compare=False)

    def cached(self, compute: "Callable[[Scene], T]") -> T:
        """Return `compute(self)`. The result is kept for later calls."""
        if compute not in self._results:
            self._results[compute] = compute(self)
        result: T = self._results[compute]
        return result

    @property
    def z_range(self) -> tuple[float, float]:
        """Lowest and highest z in m between which an obstacle blocks the robot."""
        return self.heights_above(SILL_M)

    def heights_above(self, sill: float) -> tuple[float, float]:
        """Return the lowest and highest z in m between which an obstacle blocks a robot whose wheels climb `sill` m."""
        underside = self.size.underside
        lowest = sill if underside is None else underside + MIN_HULL_OVERLAP_M
        return lowest, max(lowest + sill, self.size.height)

    @cached_property
    def start(self) -> Pose2:
        """True start pose of the robot."""
        return self.loaded.spec.only_robot.pose.pose

    @property
    def start_poses(self) -> list[Pose2]:
        """Start pose, and poses to which events move (kidnap) the robot."""
        return [self.start, *(action.spec.pose.pose for action in self.loaded.actions if action.kind == "kidnap")]

    @cached_property
    def _map(self) -> OccupancyGrid | None:
        """Map of the robot; None with `map: none`, and for a map that will be made from the world."""
        if self.loaded.map == "none":
            return None
        return self.world.grid if self.loaded.map is None else load_map(self.loaded.map)

    def outside_reason(self, pose: Pose2) -> str | None:
        """Return "outside the map (…)" or "outside the world (…)" for a pose outside; None for a pose inside.

        The robot's map counts if there is one; otherwise the bounds of the world, unless the robot has `map: none`.
        """
        grid = self._map
        if grid is not None:
            if grid.inside(grid.cell_of(np.array([[pose.x, pose.y]])))[0]:
                return None
            rows, columns = grid.shape
            size = f"{columns * grid.resolution:g} m x {rows * grid.resolution:g} m"
            return f"outside the map ({size} from ({grid.origin.x:g}, {grid.origin.y:g}))"
        left, bottom, right, top = self.world.bounds
        if self.loaded.map == "none" or (left <= pose.x <= right and bottom <= pose.y <= top):
            return None
        return f"outside the world ({left:g} … {right:g}, {bottom:g} … {top:g})"

    @cached_property
    def bodies(self) -> tuple[Solid, ...]:
        """Solids of all movable bodies at their initial poses."""
        return tuple(_at_initial_pose(self.world.bodies))

    @cached_property
    def unmoved_bodies(self) -> tuple[Solid, ...]:
        """Solids of movable bodies that have no scripted motion, and that no event moves or removes."""
        return tuple(_at_initial_pose(self._unmoved))

    @cached_property
    def immovable_bodies(self) -> tuple[Solid, ...]:
        """Solids of unmoved bodies without mass, which the robot cannot push."""
        return tuple(_at_initial_pose(body for body in self._unmoved if body.mass == 0))

    @cached_property
    def _unmoved(self) -> list[Body]:
        if self.loaded.may_do():
            return []
        moved_names = {action.spec.name for action in self.loaded.actions if action.kind in MOVING_ACTIONS}
        return [body for body in self.world.bodies if body.path is None and body.name not in moved_names]

    @cached_property
    def certain_walls(self) -> tuple[Solid, ...]:
        """Fixed solids that are certainly no ramps: upright prisms, and walls from a map."""
        has_map = self.world.grid is not None
        return tuple(s for s in self.world.solids if upright_prism(s) is not None or (has_map and s.name == "map"))

    @cached_property
    def expected_goals(self) -> list[tuple[Keys, Goal]]:
        """Goals without an expected failure, including goals of events, with the keys of their poses."""
        spec = self.loaded.spec
        first_loop = scenario_goals(spec)[: len(spec.goals)]  # further loops lead to the same poses
        listed: dict[Keys, Goal] = {("goals", k): goal for k, goal in enumerate(first_loop)}
        goals = {**listed, **event_goals(self.loaded)}
        return [((*keys, "pose"), goal) for keys, goal in goals.items() if not expects_failure(spec, goal.name)]

    def footprint_conflict(self, pose: Pose2, solids: Iterable[Solid]) -> str | None:
        """Return text such as "inside obstacle …" if the robot at a pose overlaps a solid; else None."""
        if solid := first_solid_in_disc(solids, (pose.x, pose.y), TOUCH_M, self.z_range):
            return f'inside obstacle "{solid}"'
        if solid := self.circle_conflict(pose, solids):
            radius = "radius" if self.size.radius is not None else "inscribed radius"
            return f'closer to obstacle "{solid}" than the robot\'s {radius} of {self.size.inscribed_radius:.2f} m'
        size = self.size
        if size.radius is None and (solid := first_solid_in_footprint(solids, size.footprint, pose, self.z_range)):
            return f'so close to obstacle "{solid}" that the robot\'s footprint overlaps it at this heading'
        return None

    def circle_conflict(self, pose: Pose2, solids: Iterable[Solid]) -> str | None:
        """Return the name of a solid that overlaps the robot's inscribed circle at a pose; None if there is none."""
        return first_solid_in_disc(solids, (pose.x, pose.y), self.size.inscribed_radius, self.z_range)


def _at_initial_pose(bodies: Iterable[Body]) -> Iterator[Solid]:
    """Yield the solids of bodies in the frame of the world. Each solid has the name of its body."""
    for body in bodies:
        for solid in body.solids:
            yield Solid(solid.shape, body.pose.compose(solid.pose), body.name)


def expected_failure_hint(keys: Keys, code: str) -> str:
    """Return a hint on how to declare that the goal at `keys` fails with the error code `code`."""
    if keys[0] == "goals":
        return f"expect the failure with `expect: {{error_code: {code}}}` at the goal"
    return required_failure_hint(code)


def required_failure_hint(code: str) -> str:
    """Return a hint on how to require that the whole navigation fails with the error code `code`."""
    return f"replace `goals_reached` in `pass` by `result: {{status: FAILED, error_code: {code}}}`"
