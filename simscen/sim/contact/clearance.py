"""How near the robot is to anything, and how long it therefore cannot touch anything."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import pybullet

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.records.case import CLEARANCE_RANGE
from simscen.sim.body.outline import hull_points
from simscen.sim.body.outline import radius_and_height as reach_of
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.contact.static_distance import StaticDistance, max_displacement
from simscen.sim.objects.actors import NEVER, Actors
from simscen.sim.robots.drive_factory import Base
from simscen.sim.robots.robot_state import RobotState

HORIZON = 0.1
"""Seconds for which a clearance may at most rule out a contact."""
TOLERANCE = 0.002
"""m of clearance that count as none: corners of shapes are rounded by up to 0.4 mm."""
ROUNDED = 0.05
"""m that shapes may extend further than their corners, which is where sizes come from."""

Vector = tuple[float, float, float]


class _Alone(NamedTuple):
    """When, and with the robot where, anything that moves was farther than what stands, by a `gap` in meters."""

    tick: int
    pose: Pose3
    gap: float


class Clearance:
    """Measures the distance to what stands and what moves.

    Asking the engine for contacts after every tick costs more than measuring a distance now and then: as long as
    nothing can have closed the gap, there is nothing to ask for (conservative advancement; Mirtich, Impulse-based
    dynamic simulation, 1996, section 2.3). Before tick `no_contact_before` no contact is possible.
    """

    def __init__(
        self,
        client: int,
        tick_rate: int,
        static: TriangleMesh,
        obstacles: TriangleMesh,
        uneven: bool,
        robot: RobotBody,
        base: Base,
        state: Callable[[], RobotState],
        actors: Actors,
        reach: float,
    ) -> None:
        """`state` says where the robot is now; `reach` is how far is searched, in meters.

        `obstacles` are what of the `static` world is in the robot's way, which a ramp that it drives over is not.
        `uneven`: there is ground besides the floor, for its wheels and casters to stand on.
        """
        self._client, self._rate, self._base, self._actors = client, tick_rate, base, actors
        self._state = state
        self.others: Sequence[Clearance] = ()
        """The other robots, as they are measured."""
        limits, (self._radius, self._height) = robot.limits, reach_of(robot.solid)
        self._limits, self._quickest = limits, max(limits.linear, limits.reverse or 0.0, limits.lateral or 0.0)
        self._extent = math.hypot(self._radius, self._height)
        self.size = ROUNDED + self._extent
        """How far from its base the robot extends, in m."""
        self.looks = self.size + max(reach, CLEARANCE_RANGE)
        """How far from its base things that move may be that it is measured against, in m, and no less than usual."""
        # Where wheels roll on solids they may also hit them.
        touching = replace(robot, casters=(*robot.casters, *robot.tires)) if uneven else robot
        self._proximity = StaticDistance(static, touching, reach)
        self._ways = StaticDistance(obstacles, robot, reach) if uneven else self._proximity
        self._reach = reach
        self._shaken_at = -1
        self._touched: dict[tuple[int, int, int], str] = {}
        first = robot.hull[0]
        self._core = first.pose.apply(hull_points(first.shape).mean(axis=0))
        # A closed concave surface around the start is a building, not an obstacle: nobody may start inside of one.
        self._buildings = [k for k in self._proximity.around(self._place()) if not self._proximity.convex(k)]
        self.forget()

    def forget(self) -> None:
        """Something was put into or taken out of the world, or set down elsewhere: measure anew."""
        self._distance = 0.0
        self._measured_at, self.no_contact_before = -1, 0
        self._alone: _Alone | None = None
        self._waits_until = -1
        """The tick until which it is known that samples can wait, and that nothing is touched."""
        self._actors.undisturbed(self._base.id, until=-1)
        self.enclosed_by: str | None = None
        """The solid that the robot is wholly inside of, where it touches no surface."""
        self.unsure = True
        """Whether the robot may be inside something: nothing gets there but by being set down, or by appearing."""

    def shaken(self, tick: int) -> None:
        """A push will change the robot's velocity during the step from `tick` on: how it moves now says nothing."""
        self._shaken_at = tick
        self._measured_at, self.no_contact_before, self._alone, self._waits_until = -1, tick, None, -1
        self._actors.undisturbed(self._base.id, until=tick)

    def measure(self, tick: int, ticks: int = NEVER) -> float:
        """The clearance at `tick`, which is now, in meters; the reach where nothing is nearer.

        It is asked again after so many `ticks`; how long nothing can be touched is told anew if not known until then.
        """
        if self._measured_at == tick:
            return self._distance
        pose = self._state().pose
        self._distance = gap = self._search(tick, pose, self._ways)
        if self._ways is not self._proximity:
            gap = min(gap, self._search(tick, pose, self._proximity))
        self._measured_at = tick
        if self.unsure:
            self.enclosed_by = self._enclosing(tick)
            self.unsure = self.enclosed_by is not None
        if self.enclosed_by is not None:
            self._distance = -abs(self._distance)
            gap = self._distance
        if self.no_contact_before < tick + ticks:
            free = min(HORIZON, max(0.0, gap - TOLERANCE) / self._fastest(tick))
            self.no_contact_before = tick + (math.floor(free * self._rate) if tick != self._shaken_at else 0)
        self._actors.undisturbed(self._base.id, until=self.no_contact_before)
        self._alone, self._waits_until = None, -1
        if not (self.others or self.unsure) and self._ways is self._proximity:
            farther = self._actors.gap(pose[:3], self._distance + self.size, tick, self._base.id)
            self._alone = None if farther is None else _Alone(tick, pose, farther)
        return self._distance

    def can_wait(self, tick: int, ticks: int, pose: Pose3) -> bool:
        """Whether `standing` will do for `measure` at `tick`, which is now, and nothing is touched for so many ticks.

        Told by how far the robot has come since the last measurement, and can come for a while, without another.
        """
        if tick + ticks <= self._waits_until:
            return True
        if self._alone is None:
            return False
        moved, closing = max_displacement(self._alone.pose, pose, self._extent), self._fastest(tick)
        # It may have come nearer to what moves, and gone from what stands.
        farther = self._alone.gap - 2 * moved - self._actors.come_in(tick - self._alone.tick)
        if farther <= 0:
            return False
        free = min(HORIZON, max(0.0, self._distance - moved - TOLERANCE) / closing)
        self.no_contact_before = max(self.no_contact_before, tick + math.floor(free * self._rate))
        still = math.floor(min(HORIZON, farther / (2 * closing)) * self._rate)
        self._waits_until = min(self.no_contact_before, tick + still + ticks)
        return tick + ticks <= self._waits_until

    def standing(self, pose: Pose3) -> float:
        """What `measure` gave for a robot that was at `pose`, at a tick for which it could wait."""
        return min(self._reach, self._ways.distance(pose))

    def _search(self, tick: int, pose: Pose3, standing: StaticDistance) -> float:
        nearest, place = min(self._reach, standing.distance(pose)), pose[:3]
        width = ROUNDED + self._radius + 2 * self._height * math.hypot(pose.qx, pose.qy)  # its top, where it leans
        for other in self._actors.within(place, nearest + self.size, nearest + width, tick, self._base.id):
            for link in self._base.hull_links:
                points = pybullet.getClosestPoints(self._base.id, other, nearest, link, physicsClientId=self._client)
                nearest = min((point[8] for point in points), default=nearest)
        for robot in self.others:
            nearest = min(nearest, self._to_robot(robot, place, nearest))
        return nearest

    def _to_robot(self, robot: "Clearance", place: Vector, within: float) -> float:
        """Distance in meters to another robot; inf above `within`."""
        if math.dist(place, robot._state().pose.position) > within + self.size + robot.size:
            return math.inf
        pairs = itertools.product(self._base.hull_links, robot._base.hull_links)
        found = (
            pybullet.getClosestPoints(self._base.id, robot._base.id, within, *links, physicsClientId=self._client)
            for links in pairs
        )
        return min((point[8] for points in found for point in points), default=math.inf)

    def _place(self) -> Vector:
        """A place inside the hull, in the world."""
        x, y, z = self._state().pose.apply(self._core).tolist()
        return x, y, z

    def _enclosing(self, tick: int) -> str | None:
        place = self._place()
        around = self._proximity.around(place, but=self._buildings)
        return self._proximity.name(around[0]) if around else self._actors.around(place, tick)

    def _fastest(self, tick: int) -> float:
        """The greatest speed in m/s at which the robot and anything else can approach each other for a while.

        What another robot hits leaves with up to twice its speed.
        """
        things = self._actors.top_speed(tick)
        if self.others:
            things = 2 * max(things, *[robot.own_speed() for robot in self.others])
        return self.own_speed() + things + 0.1

    def own_speed(self) -> float:
        """The greatest speed in m/s that any part of the robot can have for a while."""
        _, linear, (x, y, z) = self._state()
        forward = max(self._quickest, math.hypot(*linear))
        turning = max(self._limits.angular, math.hypot(x, y, z)) * self._radius
        return 1.25 * (forward + turning + math.hypot(x, y) * self._height)

    def owner(self, place: Vector) -> str:
        """The static solid that is touched at a place; remembered by the centimeter, since contacts last."""
        x, y, z = place
        cell = (round(100 * x), round(100 * y), round(100 * z))
        if cell not in self._touched:
            self._touched[cell] = self._proximity.owner(place)
        return self._touched[cell]

    def close(self) -> None:
        """Give the engine back."""
        self._proximity.close()
        if self._ways is not self._proximity:
            self._ways.close()
