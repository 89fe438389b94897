"""Clearance of a robot (distance to the nearest object), and the tick before which no contact is possible."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from simscen.core.geometry import Pose3, Vector
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.records.case import CLEARANCE_RANGE_M
from simscen.sim.body.outline import hull_points, radius_and_height
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import pybullet
from simscen.sim.contact.static_distance import CONTACT_DISTANCE, StaticDistance, max_displacement
from simscen.sim.objects.actor import SHAPE_MARGIN_M, SPEED_HORIZON_S
from simscen.sim.objects.actors import NEVER
from simscen.sim.robots.drive_factory import Base
from simscen.sim.robots.robot_state import RobotState
from simscen.sim.scene.scene import Scene

CONTACT_TOLERANCE_M = 0.002
"""Clearance up to which contact is possible, because corners of shapes are rounded by up to 0.4 mm."""
SPEED_GAIN_RATIO = 1.25
"""Factor by which a robot may exceed both its present speed and its speed limit within SPEED_HORIZON_S."""
CLOSING_SPEED_MARGIN_M_S = 0.1
"""Safety margin of the upper bound of closing speeds."""


class _StaticMeasurement(NamedTuple):
    """Measurement in which the static world was the nearest object.

    tick:    tick of the measurement
    pose:    pose of the robot at this tick
    margin:  lower bound in m of the additional distance to any other object
    """

    tick: int
    pose: Pose3
    margin: float


class Clearance:
    """Distance from a robot to the static world, actors (movable objects), and other robots. Call `close` after use.

    `no_contact_before` is a tick before which nothing is fast enough to touch the robot (conservative advancement;
    Mirtich, Impulse-based dynamic simulation, 1996, section 2.3).
    """

    def __init__(
        self,
        scene: Scene,
        static: TriangleMesh,
        obstacles: TriangleMesh,
        robot: RobotBody,
        base: Base,
        state: Callable[[], RobotState],
        max_range: float,
    ) -> None:
        """Prepare measurements up to `max_range` m; `state` returns the current state of the robot.

        `obstacles` is the part of the `static` world that counts for the clearance: ramps that the robot can climb do
        not count.
        """
        self._client, self._tick_rate, self._actors = scene.client, scene.tick_rate, scene.actors
        self._base, self._state = base, state
        self.others: Sequence[Clearance] = ()
        """Clearances of the other robots."""
        limits, (self._radius, self._height) = robot.limits, radius_and_height(robot.collision_solids)
        self._limits, self._max_speed = limits, max(limits.linear, limits.reverse or 0.0, limits.lateral or 0.0)
        self._extent = math.hypot(self._radius, self._height)
        self.bounding_radius = SHAPE_MARGIN_M + self._extent
        """Radius in m of the robot's bounding sphere around its base frame."""
        self.contact_radius = self.bounding_radius + CLEARANCE_RANGE_M
        """Radius in m around the robot's base frame within which actors must be able to collide."""
        self.distance_radius = max(self.contact_radius, self.bounding_radius + max_range)
        """Radius in m around the robot's base frame within which the engine must measure the distances of actors."""
        is_uneven = bool(scene.terrain and base.ground_links)
        # Wheels can also hit the solids that they roll on.
        robot_with_tires = replace(robot, casters=(*robot.casters, *robot.tires)) if is_uneven else robot
        self._static_distance = StaticDistance(static, robot_with_tires, max_range)
        self._obstacle_distance = StaticDistance(obstacles, robot, max_range) if is_uneven else self._static_distance
        self._max_range = max_range
        self._push_tick = -1
        self._static_names: dict[tuple[int, int, int], str] = {}
        """Names of touched static solids, by the position of the contact in cm."""
        first_solid = robot.hull[0]
        self._hull_center = first_solid.pose.apply(hull_points(first_solid.shape).mean(axis=0))
        """A point inside the hull in the base frame."""
        # A closed concave surface around the initial pose is a building, because no robot starts inside an obstacle.
        enclosing = self._static_distance.enclosing_solids(self._center_point())
        self._buildings = [k for k in enclosing if not self._static_distance.is_convex(k)]
        self.invalidate()

    def invalidate(self) -> None:
        """Discard all results, because an object or robot was added, removed, or placed."""
        self._distance = 0.0
        self._measured_tick = self.no_contact_before = -1
        self._static_nearest: _StaticMeasurement | None = None
        self._deferrable_until = -1
        """Latest tick of the sample that follows a deferred sample."""
        self._actors.set_no_contact_before(self._base.id, self.no_contact_before)
        self.enclosed_by: str | None = None
        """Name of the object that encloses the whole robot, or None."""
        self.may_be_enclosed = True
        """Whether the robot may be inside an object, because the robot or an object was placed."""

    def on_push(self, tick: int) -> None:
        """Discard all predictions, because something is pushed during the step that begins at `tick`."""
        self._push_tick = tick
        self._measured_tick, self.no_contact_before, self._static_nearest, self._deferrable_until = -1, tick, None, -1
        self._actors.set_no_contact_before(self._base.id, tick)

    def measure(self, tick: int, period: int = NEVER) -> float:
        """Return the clearance in m at the current `tick`, at most `max_range`; negative inside an object.

        `period` is the number of ticks until the next call. Updates `no_contact_before` if this tick is before the next
        call.
        """
        if self._measured_tick == tick:
            return self._distance
        pose = self._state().pose
        self._distance = gap = self._search(tick, pose, self._obstacle_distance)
        # The robot can also touch ramps, which do not count for the clearance.
        if self._obstacle_distance is not self._static_distance:
            gap = min(gap, self._search(tick, pose, self._static_distance))
        self._measured_tick = tick
        if self.may_be_enclosed:
            point = self._center_point()
            solids = self._static_distance.enclosing_solids(point, exclude=self._buildings)
            name = self._static_distance.name(solids[0]) if solids else self._actors.find_enclosing(point, tick)
            self.enclosed_by = name
            self.may_be_enclosed = self.enclosed_by is not None
        if self.enclosed_by is not None:
            self._distance = -abs(self._distance)
            gap = self._distance
        if self.no_contact_before < tick + period:
            free_s = min(SPEED_HORIZON_S, max(0.0, gap - CONTACT_TOLERANCE_M) / self._closing_speed(tick))
            is_pushed = tick == self._push_tick
            self.no_contact_before = tick + (0 if is_pushed else math.floor(free_s * self._tick_rate))
        self._actors.set_no_contact_before(self._base.id, self.no_contact_before)
        self._static_nearest, self._deferrable_until = None, -1
        if not (self.others or self.may_be_enclosed) and self._obstacle_distance is self._static_distance:
            margin = self._actors.free_distance(self._base.id, pose[:3], self._distance + self.bounding_radius, tick)
            self._static_nearest = None if margin is None else _StaticMeasurement(tick, pose, margin)
        return self._distance

    def can_defer(self, tick: int, period: int, pose: Pose3) -> bool:
        """Return whether the clearance at the current `tick` can be computed later, as `static_clearance(pose)`.

        This is possible if the static world is nearest and no contact is possible for `period` ticks.
        """
        if tick + period <= self._deferrable_until:
            return True
        last = self._static_nearest
        if last is None:
            return False
        moved, closing_speed = max_displacement(last.pose, pose, self._extent), self._closing_speed(tick)
        # The robot may have moved away from the static world and towards actors, which may have moved, too.
        travel = self._actors.max_scripted_travel(tick - last.tick)
        margin = last.margin - 2 * moved - travel
        if margin <= 0:
            return False
        free_s = min(SPEED_HORIZON_S, max(0.0, self._distance - moved - CONTACT_TOLERANCE_M) / closing_speed)
        self.no_contact_before = max(self.no_contact_before, tick + math.floor(free_s * self._tick_rate))
        static_ticks = math.floor(min(SPEED_HORIZON_S, margin / (2 * closing_speed)) * self._tick_rate)
        self._deferrable_until = min(self.no_contact_before, tick + static_ticks + period)
        return tick + period <= self._deferrable_until

    def static_clearance(self, pose: Pose3) -> float:
        """Return the distance in m from the robot at `pose` to the static world, at most `max_range`."""
        return min(self._max_range, self._obstacle_distance.distance(pose))

    def _search(self, tick: int, pose: Pose3, static: StaticDistance) -> float:
        """Return the distance in m to the nearest of `static`, all actors, and all other robots."""
        nearest, point = min(self._max_range, static.distance(pose)), pose[:3]
        # The top of a tilted robot extends beyond its radius.
        ground_radius = SHAPE_MARGIN_M + self._radius + 2 * self._height * math.hypot(pose.qx, pose.qy)
        for actor_id in self._actors.prepare_nearby(
            self._base.id,
            point,
            distance=nearest + self.bounding_radius,
            ground_distance=nearest + ground_radius,
            tick=tick,
        ):
            for link in self._base.hull_links:
                contacts = pybullet.getClosestPoints(
                    self._base.id, actor_id, nearest, link, physicsClientId=self._client
                )
                nearest = min((contact[CONTACT_DISTANCE] for contact in contacts), default=nearest)
        for robot in self.others:
            nearest = min(nearest, self._distance_to_robot(robot, point, nearest))
        return nearest

    def _distance_to_robot(self, robot: "Clearance", point: Vector, max_distance: float) -> float:
        """Return the distance in m to another robot; inf above `max_distance`."""
        if math.dist(point, robot._state().pose.position) > max_distance + self.bounding_radius + robot.bounding_radius:
            return math.inf
        link_pairs = itertools.product(self._base.hull_links, robot._base.hull_links)
        found = (
            pybullet.getClosestPoints(self._base.id, robot._base.id, max_distance, *links, physicsClientId=self._client)
            for links in link_pairs
        )
        return min((contact[CONTACT_DISTANCE] for contacts in found for contact in contacts), default=math.inf)

    def _center_point(self) -> Vector:
        """Return a point inside the hull in the world frame."""
        x, y, z = self._state().pose.apply(self._hull_center).tolist()
        return x, y, z

    def _closing_speed(self, tick: int) -> float:
        """Return an upper bound in m/s of the speed at which the robot and any object approach each other."""
        speed = self._actors.speed_bound(tick)
        if self.others:
            # A body that is hit by another robot leaves with up to twice its speed.
            speed = 2 * max(speed, *[robot.speed_bound() for robot in self.others])
        return self.speed_bound() + speed + CLOSING_SPEED_MARGIN_M_S

    def speed_bound(self) -> float:
        """Return an upper bound in m/s of the speed of any point of the robot within SPEED_HORIZON_S."""
        _, linear, (x, y, z) = self._state()
        forward = max(self._max_speed, math.hypot(*linear))
        turning = max(self._limits.angular, math.hypot(x, y, z)) * self._radius
        return SPEED_GAIN_RATIO * (forward + turning + math.hypot(x, y) * self._height)

    def static_solid_at(self, point: Vector) -> str:
        """Return the name of the static solid that the robot touches at a point. The result is cached."""
        x, y, z = point
        cell = (round(100 * x), round(100 * y), round(100 * z))
        if cell not in self._static_names:
            self._static_names[cell] = self._static_distance.nearest_solid_name(point)
        return self._static_names[cell]

    def close(self) -> None:
        """Release the engine clients."""
        self._static_distance.close()
        if self._obstacle_distance is not self._static_distance:
            self._obstacle_distance.close()
