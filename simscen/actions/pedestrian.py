"""`pedestrian` and `crowd`: actions that add simulated people, who walk to goals and avoid obstacles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from simscen.actions.base import WorldAction
from simscen.core.environment.world_model import Behavior, Ignorable, WalkingPedestrian
from simscen.core.geometry import Polygon, Pose2
from simscen.core.geometry.polygons import polygon_contains
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.places import Name, PlaceOrPoint, PlaceOrPose, RegionName
from simscen.spec.quantities import PositiveDuration, PositiveLength, PositiveSpeed

if TYPE_CHECKING:
    import numpy as np

Point = tuple[float, float]
"""(x, y) in m in the world frame."""
MEAN_SPEED_M_S, SPEED_STD_M_S = 1.29, 0.19
"""Mean and standard deviation of preferred walking speeds (Moussaïd et al. 2009)."""
MAX_SPEED_STDS = 2.0
"""Maximum deviation of a preferred speed from the mean, in standard deviations."""
REACTION_DEFAULTS: dict[str, tuple[float, float]] = {
    "surprised": (4.0, 30.0),
    "curious": (10.0, 30.0),
    "scared": (3.0, 40.0),
    "threatening": (4.0, 40.0),
}
"""Defaults of `reacts_within` (m) and `reacts_for` (s) by `behavior`, as in the behavior trees of HuNavSim."""
MAX_DRAWS = 200
"""Maximum number of random points to try in a region. If none of the points is free, the region counts as full."""
GROUP_HALF_WIDTH_M = 1.0
"""Maximum initial distance from the first member of a group to another member, along x and along y."""
INITIAL_CLEARANCE_M = 0.1
"""Minimum gap between a member of a crowd and obstacles at the start, and between the member and walls at a goal."""


class _WalkSettings(Spec):
    """Keys that the actions `pedestrian` and `crowd` have in common."""

    repeat: Literal["once", "loop", "back_and_forth"] = "once"
    """After the last goal: stay (`once`), walk to the first goal again (`loop`), or walk back through the goals
    (`back_and_forth`)."""
    speed: Annotated[PositiveSpeed, Field(le=3)] | None = None
    """Preferred speed; default: drawn from the seed, 1.29 m/s with a standard deviation of 0.19 m/s."""
    behavior: Behavior = "regular"
    """Reaction to the robot: `regular` treats it like a person, `impassive` like an object; `surprised` stops and looks
    at it, `curious` approaches it, `scared` keeps away from it, `threatening` steps in front of it."""
    reacts_within: Annotated[PositiveLength, Field(le=50)] | None = None
    """Distance from the robot at which the reaction starts; default, as in HuNavSim: 4 m surprised and threatening,
    10 m curious, 3 m scared."""
    reacts_for: PositiveDuration | None = None
    """Total duration of all reactions of the person; default, as in HuNavSim: 30 s surprised and curious, 40 s
    threatening. For `scared`, the duration is not limited."""
    radius: Annotated[PositiveLength, Field(ge=0.1, le=0.5)] = 0.25
    """Radius of the upright cylinder that models a body."""
    height: Annotated[PositiveLength, Field(ge=0.5, le=2.5)] = 1.7
    """Height of the cylinder."""
    blind_to: list[Ignorable] = []
    """Kinds of obstacles that the person does not notice, for example while looking at a phone. Everybody notices
    walls."""

    @model_validator(mode="after")
    def _check_reaction(self) -> _WalkSettings:
        given = [name for name in ("reacts_within", "reacts_for") if getattr(self, name) is not None]
        if given and self.behavior not in REACTION_DEFAULTS:
            raise ValueError(f"`{given[0]}` has no effect with `behavior: {self.behavior}`, which does not react")
        if self.behavior == "scared" and self.reacts_for is not None:
            raise ValueError("`reacts_for` has no effect with `behavior: scared`, which does not end")
        if self.behavior in REACTION_DEFAULTS and "robots" in self.blind_to:
            raise ValueError(f"`behavior: {self.behavior}` contradicts `blind_to: [robots]`")
        return self

    def to_pedestrian(
        self, stage: Stage, name: str, pose: Pose2, goals: tuple[Point, ...], group: str | None
    ) -> WalkingPedestrian:
        """Return a pedestrian with these settings. Members of a `group` (None: no group) have the same random speed."""
        reaction_distance, reaction_time = REACTION_DEFAULTS.get(self.behavior, (0.0, 0.0))
        return WalkingPedestrian(
            name=name,
            pose=pose,
            goals=goals,
            repeat=self.repeat,
            speed=self.speed or _draw_speed(stage.rng(f"{_stream_prefix(name, group)}, speed")),
            radius=self.radius,
            height=self.height,
            behavior=self.behavior,
            group=group,
            blind_to=frozenset(self.blind_to),
            reacts_within=self.reacts_within or reaction_distance,
            reacts_for=self.reacts_for or reaction_time,
        )


def _stream_prefix(name: str, group: str | None) -> str:
    """Return the prefix of the names of a person's random streams. The members of a group share their streams."""
    return f"person {name}" if group is None else f"group {group}"


class Pedestrian(_WalkSettings, WorldAction):
    """Add a person who walks to goals and avoids walls, objects, other people, and robots.

    Pedestrians walk by the social force model of Moussaïd et al. (2009) and react to the robot like the people of
    HuNavSim (Pérez-Higueras et al., 2023). They cannot be pushed. They walk into nothing except objects and robots that
    they are `blind_to`.

    Example: `do: {pedestrian: {name: anna, pose: {x: 4, y: 1}, goals: [[4, 5]], behavior: surprised}}`
    """

    name: Name
    """Name of the pedestrian."""
    pose: PlaceOrPose
    """Initial pose, or a place by name."""
    goals: Annotated[list[PlaceOrPoint], Field(max_length=1000)] = []
    """Goals in order: points [x, y] in the world frame, or places by name. Without goals, the person
    stands still, and returns to the initial position after stepping aside."""
    group: Name | None = None
    """Group of the pedestrian. Members of a group walk side by side."""

    def perform(self, stage: Stage) -> Effect:
        """Add the pedestrian. Has no effect if its initial position is not free."""
        pose = self.pose.pose
        if not stage.has_room((pose.x, pose.y), self.radius):
            return Effect(False, f"there is no free space for {self.name} at ({pose.x:.2f}, {pose.y:.2f})")
        goals = tuple((x, y) for x, y in self.goals)
        stage.add_pedestrian(self.to_pedestrian(stage, self.name, pose, goals, self.group))
        return Effect(True, f"added {self.name} at ({pose.x:.2f}, {pose.y:.2f})")


class Crowd(_WalkSettings, WorldAction):
    """Add several people at once, with initial positions and goals drawn at random from regions.

    They are named `<name>-1`, `<name>-2`, … A larger `count` adds people without changing the others.

    Example: `do: {crowd: {name: visitor, count: 5, start: hall, goals: [hall], repeat: back_and_forth}}`
    """

    name: Name
    """Common name of the people. A number from 1 is appended for each person."""
    count: Annotated[int, Field(ge=1, le=500)]
    """Number of people."""
    start: RegionName
    """Region in whose free space the initial positions are drawn."""
    goals: Annotated[list[RegionName], Field(max_length=100)] = []
    """Regions in order. Each person gets one random goal in each region. Without regions, all stand still."""
    group_size: Annotated[int, Field(ge=1, le=6)] = 1
    """Number of people who walk together to the same goals."""

    @property
    def names(self) -> list[str]:
        return [f"{self.name}-{number}" for number in range(1, self.count + 1)]

    def perform(self, stage: Stage) -> Effect:
        """Add the people. If a region has too little free space, add fewer; the effect then counts as failed."""
        group_start: Point | None = None  # of the first member of the current group
        for index in range(self.count):
            if index % self.group_size == 0:
                group_start = None
            rng = stage.rng(f"person {self.names[index]}, start")
            start = _draw_point(stage, rng, stage.region(self.start), self.radius, near=group_start)
            full_region = self.start if start is None else self._add_person(stage, index, start)
            if full_region is not None:
                return Effect(False, f"added only {index} of {self.count} people: no more free space in {full_region}")
            group_start = group_start or start
        return Effect(True, f"added {self.count} people in {self.start}")

    def _add_person(self, stage: Stage, index: int, start: Point) -> str | None:
        """Add the person with this index at `start`, and return None.

        If a goal region has no free space, add nobody, and return the name of this region.
        """
        name, group = self.names[index], None
        if self.group_size > 1:
            group = f"{self.name} group {index // self.group_size + 1}"
        rng = stage.rng(f"{_stream_prefix(name, group)}, goals")
        goals: list[Point] = []
        for region in self.goals:
            goal = _draw_point(stage, rng, stage.region(region), self.radius, walls_only=True)
            if goal is None:
                return region
            goals.append(goal)
        yaw = float(rng.uniform(-math.pi, math.pi))
        if goals:
            yaw = math.atan2(goals[0][1] - start[1], goals[0][0] - start[0])
        stage.add_pedestrian(self.to_pedestrian(stage, name, Pose2(*start, yaw), tuple(goals), group))
        return None


def _draw_point(
    stage: Stage,
    rng: np.random.Generator,
    corners: Polygon,
    radius: float,
    near: Point | None = None,
    walls_only: bool = False,
) -> Point | None:
    """Return a random point inside the polygon `corners` with room for a pedestrian; None if none was found.

    radius:      radius of the pedestrian in m
    near:        center of a square with sides of 2 GROUP_HALF_WIDTH_M that limits the result; None: no limit
    walls_only:  whether only walls count as obstacles
    """
    if near is None:
        xs, ys = zip(*corners, strict=True)
        center = (min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2
        half_size = (max(xs) - min(xs)) / 2, (max(ys) - min(ys)) / 2
    else:
        center, half_size = near, (GROUP_HALF_WIDTH_M, GROUP_HALF_WIDTH_M)
    for _ in range(MAX_DRAWS):
        x, y = rng.uniform(-1.0, 1.0, 2).tolist()
        point = center[0] + x * half_size[0], center[1] + y * half_size[1]
        if polygon_contains(corners, point) and stage.has_room(point, radius + INITIAL_CLEARANCE_M, walls_only):
            return point
    return None


def _draw_speed(rng: np.random.Generator) -> float:
    """Return a random preferred speed in m/s."""
    draw = float(rng.standard_normal())
    return MEAN_SPEED_M_S + SPEED_STD_M_S * max(-MAX_SPEED_STDS, min(MAX_SPEED_STDS, draw))
