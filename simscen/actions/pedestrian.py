"""`pedestrian`, `crowd`: people who walk by themselves."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

from pydantic import Field, model_validator

from simscen.actions.base import Action
from simscen.core.environment.world_model import Behavior, Polygon, Unseen, WalkingPedestrian
from simscen.core.geometry import Pose2
from simscen.core.geometry.polygons import polygon_contains
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.named_places import PlaceOrPoint, PlaceOrPose
from simscen.spec.places import Name
from simscen.spec.quantities import PositiveDuration, PositiveLength, PositiveSpeed
from simscen.spec.references import RegionName

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np

Place = tuple[float, float]
LIKED_SPEED, SPREAD, MOST_SPREAD = 1.29, 0.19, 2.0
"""Mean and standard deviation in m/s of how fast people walk (Moussaïd et al. 2009), and how many of these at most."""
REACTIONS: dict[str, tuple[float, float]] = {
    "surprised": (4.0, 30.0),
    "curious": (10.0, 30.0),
    "scared": (3.0, 40.0),
    "threatening": (4.0, 40.0),
}
"""Meters within which each begins and seconds after which it ends, of HuNavSim's behavior trees."""
TRIES = 200
"""Places drawn for one of a crowd before there is no room."""
TOGETHER = 1.0
"""m along x and y at most between the first of a group and the others, at first."""
ELBOW_ROOM = 0.1
"""m between those of a crowd, and between them and walls, at first."""


class _Walks(Spec):
    """What a single person and those of a crowd have in common."""

    repeat: Literal["once", "loop", "back_and_forth"] = "once"
    """At the last goal: stay, go to the first again, or go back from goal to goal."""
    speed: Annotated[PositiveSpeed, Field(le=3)] | None = None
    """The speed they like to walk at; default: drawn from the seed, 1.29 m/s with a standard deviation of 0.19 m/s."""
    behavior: Behavior = "regular"
    """How they take the robot: `regular` as another person, `impassive` as a thing; `surprised` stop and look at it,
    `curious` come up to it, `scared` keep away from it, `threatening` step in front of it."""
    reacts_within: Annotated[PositiveLength, Field(le=50)] | None = None
    """How near the robot is when they react; default, as in HuNavSim: 4 m surprised and threatening, 10 m curious,
    3 m scared."""
    reacts_for: PositiveDuration | None = None
    """How long they do; default, as in HuNavSim: 30 s surprised and curious, 40 s threatening. The scared do not
    get used to it."""
    radius: Annotated[PositiveLength, Field(ge=0.1, le=0.5)] = 0.25
    """Of the upright cylinder that a body is."""
    height: Annotated[PositiveLength, Field(ge=0.5, le=2.5)] = 1.7
    """Of that cylinder."""
    blind_to: list[Unseen] = []
    """What they take no notice of, like somebody who looks at a phone; walls they always see."""

    @model_validator(mode="after")
    def _reacts(self) -> _Walks:
        given = [name for name in ("reacts_within", "reacts_for") if getattr(self, name) is not None]
        if given and self.behavior not in REACTIONS:
            raise ValueError(f"`{given[0]}` has no meaning for the {self.behavior}, who do not react")
        if self.behavior == "scared" and self.reacts_for is not None:
            raise ValueError("`reacts_for` has no meaning for the scared, who do not get used to the robot")
        if self.behavior in REACTIONS and "robots" in self.blind_to:
            raise ValueError(f"who is blind to robots cannot be {self.behavior}")
        return self

    def somebody(
        self, stage: Stage, name: str, pose: Pose2, goals: tuple[Place, ...], group: str | None
    ) -> WalkingPedestrian:
        """One of them; those of a group like the same speed."""
        within, lasts = REACTIONS.get(self.behavior, (0.0, 0.0))
        whose = f"person {name}" if group is None else f"group {group}"
        speed = self.speed if self.speed is not None else _liked(stage.chance(f"{whose}, speed"))
        return WalkingPedestrian(
            name=name,
            pose=pose,
            goals=goals,
            repeat=self.repeat,
            speed=speed,
            radius=self.radius,
            height=self.height,
            behavior=self.behavior,
            group=group,
            blind_to=frozenset(self.blind_to),
            reacts_within=self.reacts_within or within,
            reacts_for=self.reacts_for or lasts,
        )


class Pedestrian(_Walks, Action):
    """Let a person come who walks to goals by themselves, around walls, things, others and the robot.

    They walk by the social force model of Moussaïd et al. (2009) and take the robot as HuNavSim's people do
    (Pérez-Higueras et al., 2023). Nobody can push them, and they walk through nothing. Imitates whoever shares the
    floor with a robot: staff, visitors, children.

    Example: `do: {pedestrian: {name: anna, pose: {x: 4, y: 1}, goals: [[4, 5]], behavior: surprised}}`
    """

    name: Name
    """What they are called from now on."""
    pose: PlaceOrPose
    """Where they come into the world, and what they face: a pose, or a place by name."""
    goals: Annotated[list[PlaceOrPoint], Field(max_length=1000)] = []
    """Where they walk to, in turn: points [x, y] in the world frame, or places by name; none: they stand, and come back
    when pushed aside."""
    group: Name | None = None
    """Those of one group keep together, side by side."""

    @property
    def of_a_robot(self) -> bool:
        """Whoever comes, comes to all."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Let them come; nothing comes of it where there is no room for them."""
        pose = self.pose.pose
        if not stage.room((pose.x, pose.y), self.radius):
            return Effect(False, f"there is no room for {self.name} at ({pose.x:.2f}, {pose.y:.2f})")
        goals = tuple((x, y) for x, y in self.goals)
        stage.walk(self.somebody(stage, self.name, pose, goals, self.group))
        return Effect(True, f"{self.name} comes at ({pose.x:.2f}, {pose.y:.2f})")


class Crowd(_Walks, Action):
    """Let many people come at once, who start at places drawn from a region and walk to places drawn from others.

    They are called `<name>-1`, `<name>-2`, … Each draws from random streams of their own, so that one more changes
    nobody else. Imitates a hall at noon.

    Example: `do: {crowd: {name: visitor, count: 5, start: hall, goals: [hall], repeat: back_and_forth}}`
    """

    name: Name
    """What each is called, before a number from 1 on."""
    count: Annotated[int, Field(ge=1, le=500)]
    """How many."""
    start: RegionName
    """Where each starts, anywhere in it where there is room."""
    goals: Annotated[list[RegionName], Field(max_length=100)] = []
    """Each walks to a place in each of these regions in turn; none: they stand."""
    group_size: Annotated[int, Field(ge=1, le=6)] = 1
    """How many of them walk together, to the same places."""

    @property
    def names(self) -> list[str]:
        """What they are called."""
        return [f"{self.name}-{number}" for number in range(1, self.count + 1)]

    @property
    def of_a_robot(self) -> bool:
        """Whoever comes, comes to all."""
        return False

    def perform(self, stage: Stage) -> Effect:
        """Let them come; nothing has come of it where there was no room for all."""
        came, first = 0, None
        for number in range(self.count):
            place = self._place(stage, number, first if number % self.group_size else None)
            if place is None or not self._come(stage, number, place):
                break  # nor is there room for the next
            came += 1
            first = first if number % self.group_size else place
        if came < self.count:
            return Effect(False, f"there was room in {self.start} for {came} of {self.count} only")
        return Effect(True, f"{came} people come in {self.start}")

    def _place(self, stage: Stage, number: int, friend: Place | None) -> Place | None:
        """Where somebody starts: anywhere in the region, or beside the first of their group."""
        chance, corners = stage.chance(f"person {self.names[number]}, start"), stage.region(self.start)
        near = Box(*friend, TOGETHER, TOGETHER) if friend is not None else _around(corners)
        for place in near.places(chance):
            if polygon_contains(corners, place) and stage.room(place, self.radius + ELBOW_ROOM):
                return place
        return None

    def _come(self, stage: Stage, number: int, place: Place) -> bool:
        """Whether there were goals for them as well."""
        name, group = self.names[number], None
        if self.group_size > 1:
            group = f"{self.name} group {number // self.group_size + 1}"
        chance = stage.chance(f"{f'person {name}' if group is None else f'group {group}'}, goals")
        goals = [_goal(stage, chance, stage.region(region), self.radius) for region in self.goals]
        chosen = tuple(goal for goal in goals if goal is not None)
        if len(chosen) < len(goals):
            return False
        yaw = float(chance.uniform(-math.pi, math.pi))
        if chosen:
            yaw = math.atan2(chosen[0][1] - place[1], chosen[0][0] - place[0])
        stage.walk(self.somebody(stage, name, Pose2(*place, yaw), chosen, group))
        return True


class Box(NamedTuple):
    """A rectangle: its middle, and half its sides in meters."""

    x: float
    y: float
    across: float
    up: float

    def places(self, chance: np.random.Generator) -> Iterator[Place]:
        """Places in it, TRIES of them."""
        for _ in range(TRIES):
            across, up = chance.uniform(-1.0, 1.0, 2).tolist()
            yield self.x + across * self.across, self.y + up * self.up


def _around(corners: Polygon) -> Box:
    xs, ys = zip(*corners, strict=True)
    return Box((min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2, (max(xs) - min(xs)) / 2, (max(ys) - min(ys)) / 2)


def _goal(stage: Stage, chance: np.random.Generator, corners: Polygon, radius: float) -> Place | None:
    """A place in a region where no wall is in the way; None where none was found."""
    inside = (place for place in _around(corners).places(chance) if polygon_contains(corners, place))
    return next((place for place in inside if stage.room(place, radius + ELBOW_ROOM, walls_only=True)), None)


def _liked(chance: np.random.Generator) -> float:
    """A speed that somebody may like to walk at, in m/s."""
    drawn = float(chance.standard_normal())
    return LIKED_SPEED + SPREAD * max(-MOST_SPREAD, min(MOST_SPREAD, drawn))
