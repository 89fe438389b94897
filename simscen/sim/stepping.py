"""Advances the physics of a run, and updates robots and objects when something is pushed, added, or placed."""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from simscen.sim.bullet import pybullet
from simscen.sim.objects.proximity import ACTIVATION_PERIOD_S, EARLY_QUERY_DISTANCE_M, REQUERY_DISTANCE_M
from simscen.sim.objects.rest import SAMPLE_COUNT, SAMPLE_PERIOD_TICKS
from simscen.sim.robots.robot import Robot
from simscen.sim.scene.scene import Scene

REST_UPDATE_PERIOD_S = 5.0
"""Time between two updates of the poses in which pushable objects have come to rest."""
SETTLING_TICKS = 60
"""Number of ticks before tick 0 in which everything comes to rest on the ground."""

Push = Callable[[tuple[float, float]], None]
"""Applies an impulse (N s, world frame) to a robot or an object during the next tick."""


@dataclass(frozen=True)
class TimedPush:
    """Push that lasts several ticks: calls `push(impulse)` at each tick from `start_tick` to `end_tick - 1`.

    `impulse` is the impulse of one tick in N s, in the world frame.
    """

    push: Push
    impulse: tuple[float, float]
    start_tick: int
    end_tick: int


class Stepper:
    """Steps a scene with its robots. Add, remove, or place objects and robots only in the context `change`.

    Three optimizations save time. While no robot can touch anything, only the physics and the firmware of the robots
    run. Walls are created in the engine when a robot or a pushable object can reach them. Actors (movable objects) that
    cannot be pushed start to collide when a robot comes near.
    """

    def __init__(self, scene: Scene, robots: Iterable[Robot], firmware_period: int) -> None:
        """Take the robots, sorted by name. Their firmware runs every `firmware_period` ticks."""
        self._scene, self._robots, self._firmware_period = scene, tuple(robots), firmware_period
        self._rest_update_period = math.ceil(REST_UPDATE_PERIOD_S * scene.tick_rate)
        self._activation_period = math.ceil(ACTIVATION_PERIOD_S * scene.tick_rate)
        self._periodic_call: tuple[int, Callable[[], None]] | None = None
        self._pushes: list[TimedPush] = []

    def settle(self) -> None:
        """Simulate SETTLING_TICKS before tick 0, and put the objects that are at rest to sleep."""
        self._activate_actors()
        if not self._scene.walls.is_complete:
            self._build_walls(SETTLING_TICKS)
        actors = self._scene.actors
        rest_detector = actors.make_rest_detector()
        for tick in range(1 - SETTLING_TICKS, 1):
            if tick == 0:
                actors.put_to_sleep(rest_detector.resting_ids())
            pybullet.stepSimulation(self._scene.client)
            if -SAMPLE_PERIOD_TICKS * SAMPLE_COUNT <= tick < 0 and tick % SAMPLE_PERIOD_TICKS == 0:
                rest_detector.sample()
        actors.update_rest_poses(0)

    def call_before_steps(self, period: int, function: Callable[[], None]) -> None:
        """Call `function` before each step that begins at a multiple of `period` ticks. Replaces the last function."""
        self._periodic_call = period, function

    # Steps

    def step(self, ticks: int) -> None:
        """Simulate `ticks` ticks."""
        scene, until = self._scene, self._scene.tick + ticks
        has_pushable = scene.actors.has_pushable
        if has_pushable or scene.actors.has_deferred:
            period = self._rest_update_period if has_pushable else self._activation_period
            for due in range(scene.tick - scene.tick % period + period, until + 1, period):
                self._step_uninterrupted(due - scene.tick)
                if has_pushable:
                    scene.actors.update_rest_poses(due)
                else:
                    self._activate_actors(EARLY_QUERY_DISTANCE_M)
        if scene.tick < until:
            self._step_uninterrupted(until - scene.tick)
        self._activate_actors()

    def _step_uninterrupted(self, ticks: int) -> None:
        """Simulate `ticks` ticks without the periodic updates that `step` makes.

        The loop handles periodic calls, pushes, changed friction, and contact. `_step_without_contact` simulates the
        ticks that need none of these, because it is faster.
        """
        scene, no_contact_before = self._scene, -1
        until, is_undisturbed = scene.tick + ticks, not (self._pushes or self._periodic_call or scene.floor)
        if is_undisturbed and (no_contact_before := self._no_contact_before(ticks)) >= until:
            self._step_without_contact(until)
            return
        while scene.tick < until:
            if scene.tick >= no_contact_before:
                no_contact_before = self._no_contact_before(ticks)
            if is_undisturbed and scene.tick < no_contact_before:
                self._step_without_contact(min(until, no_contact_before))
                continue
            if self._periodic_call is not None and scene.tick % self._periodic_call[0] == 0:
                self._periodic_call[1]()
            if scene.tick % self._firmware_period == 0:
                for robot in self._robots:
                    robot.advance()
            if scene.floor:
                scene.floor.remove_expired(scene.tick)
                for robot in self._robots:
                    robot.base.set_friction(scene.floor.friction)
            if self._pushes and self._apply_pushes():
                no_contact_before = -1
            if scene.tick < no_contact_before:
                pybullet.stepSimulation(scene.client)
                scene.tick += 1
            else:
                self._step_with_contact()

    def _step_without_contact(self, until: int) -> None:
        """Simulate until the tick `until`, before which no robot can touch anything."""
        scene, tick = self._scene, self._scene.tick
        while tick < until:
            if tick % self._firmware_period == 0:
                scene.tick = tick
                for robot in self._robots:
                    robot.advance()
            pybullet.stepSimulation(scene.client)
            tick += 1
        scene.tick = tick

    def _no_contact_before(self, ticks: int) -> int:
        """Return a tick before which no robot can touch anything, and no object on a path can push another object.

        If such a contact is possible in the next step, the tick is not in the future. Also creates the walls that
        pushable objects can reach within `ticks`.
        """
        actors = self._scene.actors
        if not actors.has_pushable:
            return min([robot.no_contact_before for robot in self._robots])
        if not self._scene.walls.is_complete:
            self._build_walls(ticks)
        no_contact_before = min([robot.no_contact_before for robot in self._robots])
        no_push_before = actors.no_push_before(
            self._scene.tick, lambda: max([robot.clearance.speed_bound() for robot in self._robots])
        )
        return min(no_contact_before, no_push_before)

    def _step_with_contact(self) -> None:
        """Simulate one tick: move the objects that follow a path, step, and record the contacts of robots."""
        scene = self._scene
        # If no robot can touch anything, only objects can touch each other.
        can_touch_robots = scene.tick >= min([robot.no_contact_before for robot in self._robots])
        if can_touch_robots:
            self._activate_actors()
        scene.actors.begin_step(scene.tick, all_scripted=can_touch_robots)
        if can_touch_robots:
            motions = {robot.base.id: robot.before_contact_step() for robot in self._robots}
            if not scene.walls.is_complete:
                self._build_walls(1)
            motions |= scene.actors.motions(scene.tick)
        pybullet.stepSimulation(scene.client)
        scene.tick += 1
        if can_touch_robots:
            for robot in self._robots:
                robot.after_contact_step(motions)
        scene.actors.end_step(scene.tick, all_scripted=can_touch_robots)

    def _build_walls(self, ticks: int) -> None:
        """Create the walls that robots may touch now, and the walls that pushable objects can reach within `ticks`."""
        scene = self._scene
        robots = [
            (robot.base.id, robot.base_pose().position, robot.clearance.bounding_radius) for robot in self._robots
        ]
        for sphere in itertools.chain(robots, scene.actors.reachable_spheres(scene.tick, ticks)):
            if new_walls := scene.walls.build_near(*sphere):
                for robot in self._robots:
                    robot.add_bodies(dict.fromkeys(new_walls))

    def _activate_actors(self, min_moved: float = REQUERY_DISTANCE_M) -> None:
        """Let the deferred actors near robots collide.

        Skips robots that have moved less than `min_moved` m since their last query.
        """
        actors = self._scene.actors
        if not actors.has_deferred:
            return
        queries = [robot.make_query() for robot in self._robots if robot.distance_since_query >= min_moved]
        if queries and (activated := actors.activate_near(queries, self._scene.tick)):
            for robot in self._robots:
                robot.add_bodies(activated)

    # Changes between steps

    @contextmanager
    def change(self) -> Iterator[None]:
        """Context in which an object is added, removed, or moved, or a robot is placed."""
        for robot in self._robots:
            robot.compute_deferred()
        yield
        self._activate_actors(min_moved=0.0)
        for robot in self._robots:
            robot.on_change(self._robots)

    def add_push(self, push: Push, impulse: tuple[float, float], seconds: float, tick: int) -> None:
        """Schedule calls of `push` that spread an impulse (N s, world frame) evenly over `seconds` from `tick` on."""
        ticks = max(1, round(seconds * self._scene.tick_rate))
        self._pushes.append(TimedPush(push, (impulse[0] / ticks, impulse[1] / ticks), tick, tick + ticks))

    def _apply_pushes(self) -> bool:
        """Apply the pushes of the next step; return whether any push is active or scheduled."""
        tick = self._scene.tick
        self._pushes = [push for push in self._pushes if push.end_tick > tick]
        for push in self._pushes:
            if push.start_tick <= tick:
                push.push(push.impulse)
        if self._pushes:
            self.on_push()
        return bool(self._pushes)

    def on_push(self) -> None:
        """Discard all predictions of robots and actors, because something is or will be pushed."""
        self._scene.actors.on_push(self._scene.tick)
        for robot in self._robots:
            robot.clearance.on_push(self._scene.tick)
