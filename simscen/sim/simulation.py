"""Physics simulation of one run: robots, static world, and movable objects. A tick is one physics step."""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from simscen.core.environment.world_model import Patch
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, MotionPath, TriangleMesh
from simscen.core.records.case import CLEARANCE_RANGE_M
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import engine, pybullet
from simscen.sim.bullet.client_pool import CLIENT_POOL
from simscen.sim.bullet.collision_shapes import Triangulate
from simscen.sim.contact.collisions import PreStepMotion
from simscen.sim.objects.actors import Actors
from simscen.sim.objects.proximity import ACTIVATION_PERIOD_S, EARLY_QUERY_DISTANCE_M
from simscen.sim.objects.rest import SAMPLE_COUNT, SAMPLE_PERIOD_TICKS
from simscen.sim.robots.robot import Robot, Scene
from simscen.sim.scene.camera import RenderScene
from simscen.sim.scene.terrain import Terrain
from simscen.sim.scene.walls import Walls

FIRMWARE_RATE_HZ = 60
"""Rate at which the firmware of a robot's base updates the wheel speeds."""
REST_UPDATE_PERIOD_S = 5.0
"""Time between two updates of the poses in which pushable objects have come to rest."""
SETTLING_TICKS = 60
"""Number of ticks before tick 0 in which everything comes to rest on the ground."""


class RobotPlacement(NamedTuple):
    """Body and initial pose of a robot.

    `obstacles` is the part of the static world that counts for its clearance (None: all).
    """

    body: RobotBody
    pose: Pose2
    obstacles: TriangleMesh | None = None


class Simulation:
    """Physics of one run. Create it in the process that uses it, and call `close` after use."""

    def __init__(
        self,
        static: TriangleMesh,
        bodies: Iterable[Body],
        robots: Mapping[str, RobotPlacement],
        triangulate: Triangulate,
        tick_rate: int = 240,
        solver_iterations: int = 10,
        clearance_range: float = CLEARANCE_RANGE_M,
        has_images: bool = True,
    ) -> None:
        """Build the world with the robots at rest at their initial poses. `tick_rate` is in Hz.

        `static` is the static world, and `bodies` are the movable objects. `triangulate` returns the surface of a shape
        that PyBullet does not support. Clearances are measured up to `clearance_range` m. Without `has_images`, cameras
        cannot be used.
        """
        client = CLIENT_POOL.take()
        engine.set_physics_parameters(client, tick_rate, solver_iterations, solve_islands_separately=len(robots) > 1)
        terrain = Terrain(client, static, max((w.radius for r in robots.values() for w in r.body.wheels), default=0.0))
        walls = Walls(client, terrain.obstacles)
        visual_shape = engine.DEFAULT_VISUAL if has_images else engine.create_invisible_shape(client)
        render_scene = RenderScene(client, static, triangulate) if has_images else None
        actors = Actors(client, tick_rate, triangulate, visual_shape, is_rendered=has_images)
        self._scene = Scene(client, tick_rate, walls, terrain, actors, render_scene)
        self._periodic_call: tuple[int, Callable[[], None]] | None = None
        self._firmware_period = max(1, round(tick_rate / FIRMWARE_RATE_HZ))
        self._rest_update_period = math.ceil(REST_UPDATE_PERIOD_S * tick_rate)
        self._activation_period = math.ceil(ACTIVATION_PERIOD_S * tick_rate)
        self.robots: dict[str, Robot] = self._scene.robots
        self._robots: tuple[Robot, ...] = ()
        for name, (body, pose, own_obstacles) in sorted(robots.items()):
            period = self._firmware_period / tick_rate
            obstacles = static if own_obstacles is None else own_obstacles
            self.robots[name] = Robot(
                name, self._scene, static, obstacles, body, pose, period, clearance_range, visual_shape
            )
        actors.add_all((terrain.raise_to_ground(body) for body in sorted(bodies, key=lambda body: body.name)), 0)
        self._scene.activate_actors()
        if not walls.is_complete:
            self._build_walls(SETTLING_TICKS)
        self._settle()
        for name, robot in self.robots.items():
            robot.set_pose(robots[name].pose)
        self._robots = tuple(self.robots.values())
        self._scene.after_change()

    def _settle(self) -> None:
        """Simulate SETTLING_TICKS, and put the objects that are at rest to sleep."""
        actors = self._scene.actors
        rest_detector = actors.make_rest_detector()
        for tick in range(1 - SETTLING_TICKS, 1):
            if tick == 0:
                actors.put_to_sleep(rest_detector.resting_ids())
            pybullet.stepSimulation(self._scene.client)
            if -SAMPLE_PERIOD_TICKS * SAMPLE_COUNT <= tick < 0 and tick % SAMPLE_PERIOD_TICKS == 0:
                rest_detector.sample()
        actors.update_rest_poses(0)

    @property
    def tick(self) -> int:
        """Ticks since the start."""
        return self._scene.tick

    # Stepping

    def step(self, ticks: int) -> None:
        """Simulate `ticks` ticks."""
        scene, until = self._scene, self._scene.tick + ticks
        has_pushable = scene.actors.has_pushable
        if has_pushable or not scene.actors.is_engine_complete:
            period = self._rest_update_period if has_pushable else self._activation_period
            for due in range(scene.tick - scene.tick % period + period, until + 1, period):
                self._step_uninterrupted(due - scene.tick)
                if has_pushable:
                    scene.actors.update_rest_poses(due)
                else:
                    scene.activate_actors(EARLY_QUERY_DISTANCE_M)
        if scene.tick < until:
            self._step_uninterrupted(until - scene.tick)
        scene.activate_actors()

    def _step_uninterrupted(self, ticks: int) -> None:
        """Simulate `ticks` ticks without the periodic updates that `step` makes."""
        scene, no_contact_before = self._scene, -1
        until, is_plain = scene.tick + ticks, not (scene.pushes or self._periodic_call or scene.floor)
        if is_plain and (no_contact_before := self._no_contact_before(ticks)) >= until:
            self._step_without_contact(until)
            return
        while scene.tick < until:
            if scene.tick >= no_contact_before:
                no_contact_before = self._no_contact_before(ticks)
            if is_plain and scene.tick < no_contact_before:
                self._step_without_contact(min(until, no_contact_before))
                continue
            if self._periodic_call is not None and scene.tick % self._periodic_call[0] == 0:
                self._periodic_call[1]()
            if scene.tick % self._firmware_period == 0:
                for robot in self._robots:
                    robot.advance()
            if scene.floor:
                scene.update_wheel_friction()
            if scene.pushes and scene.apply_pushes():
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
        """Return the tick before which no contact is possible, or -1 if contact is possible in the next step.

        Also creates the walls that pushable objects can reach within `ticks`.
        """
        actors = self._scene.actors
        if not actors.has_pushable:
            return min([robot.no_contact_before for robot in self._robots])
        if not self._scene.walls.is_complete:
            self._build_walls(ticks)
        no_contact_before = min([robot.no_contact_before for robot in self._robots])
        return min(no_contact_before, actors.no_push_before(self._scene.tick, self._robot_speed_bound))

    def _robot_speed_bound(self) -> float:
        """Return an upper bound in m/s of the speed of any point of any robot."""
        return max([robot.clearance.speed_bound() for robot in self._robots])

    def _step_with_contact(self) -> None:
        """Simulate one tick: first move the objects that follow a path, afterwards record the contacts of robots."""
        scene = self._scene
        if scene.tick < min([robot.no_contact_before for robot in self._robots]):  # only objects can touch each other
            scene.actors.begin_step(scene.tick, all_scripted=False)
            pybullet.stepSimulation(scene.client)
            scene.tick += 1
            scene.actors.end_step(scene.tick, all_scripted=False)
            return
        scene.activate_actors()
        scene.actors.begin_step(scene.tick)
        motions = {robot.base.id: robot.before_contact_step() for robot in self.robots.values()}
        if not scene.walls.is_complete:
            self._build_walls(1)
        velocities = scene.actors.velocities(scene.tick)
        pybullet.stepSimulation(scene.client)
        scene.tick += 1
        for robot in self.robots.values():
            robot.after_contact_step(PreStepMotion(motions[robot.base.id], velocities, motions))
        scene.actors.end_step(scene.tick)

    def _build_walls(self, ticks: int) -> None:
        """Create the walls that robots may touch now, and the walls that pushable objects can reach within `ticks`."""
        scene = self._scene
        robots = [
            (robot.base.id, robot.base_pose().position, robot.clearance.bounding_radius)
            for robot in self.robots.values()
        ]
        for sphere in itertools.chain(robots, scene.actors.reachable_spheres(scene.tick, ticks)):
            if new_walls := scene.walls.build_near(*sphere):
                for robot in self.robots.values():
                    robot.add_bodies(dict.fromkeys(new_walls))

    def call_before_steps(self, period: int, function: Callable[[], None]) -> None:
        """Call `function` before each step that begins at a multiple of `period` ticks. Replaces the last function."""
        self._periodic_call = period, function

    # Changing the world

    def add_friction_patch(self, name: str, patch: Patch) -> None:
        """Change the friction of an area of the floor; replaces a patch of the same name."""
        self._scene.floor.add(name, patch)

    def spawn(self, body: Body) -> None:
        """Add a body to the world."""
        self._scene.before_change()
        self._scene.actors.add(self._scene.terrain.raise_to_ground(body), self.tick)
        self._scene.after_change()

    def remove(self, name: str) -> None:
        """Remove a body from the world; unknown names are ignored."""
        self._scene.before_change()
        self._scene.actors.remove(name)
        self._scene.after_change()

    def move(self, name: str, path: MotionPath) -> None:
        """Let a body follow a path from now on. It cannot be pushed any more. Raises KeyError for an unknown name."""
        self._scene.before_change()
        self._scene.actors.move(name, path, self.tick)
        self._scene.after_change()

    def place(self, name: str, pose: Pose2) -> None:
        """Place a body at rest at `pose`, and end its path; raises KeyError for an unknown name."""
        self._scene.before_change()
        self._scene.actors.place(name, pose, self.tick)
        self._scene.after_change()

    def push_object(self, name: str, impulse: tuple[float, float], seconds: float = 0.0) -> None:
        """Apply an impulse (N s, world frame) to a body, spread over `seconds` from the next tick on.

        Has no effect on a body that does not exist or cannot be pushed.
        """
        actors = self._scene.actors
        actors.wake(name)
        self._scene.add_push(partial(actors.push, name), impulse, seconds, self.tick + 1)

    def add_steered(self, body: Body, max_speed: float) -> None:
        """Add a body with a circular outline, such as a pedestrian. `follow` can move it at up to `max_speed` m/s."""
        self._scene.before_change()
        path = MotionPath((0.0,), (body.pose.plane,))
        self._scene.actors.add(replace(body, path=path), self.tick, is_steered=True)
        self._scene.actors.follow(body.name, path, max_speed, self.tick)
        self._scene.after_change()

    def follow(self, name: str, path: MotionPath, max_speed: float) -> None:
        """Let a body from `add_steered` follow a path from its pose on. The path must not exceed `max_speed` m/s."""
        self._scene.actors.follow(name, path, max_speed, self.tick)

    # Observing the world

    def motion(self, name: str) -> tuple[MotionPath, float] | None:
        """Return the path that a body follows and the seconds since its start, or None if it follows no path."""
        return self._scene.actors.motion(name, self.tick)

    def mass(self, name: str) -> float:
        """Return the mass in kg of a body, or 0 if it cannot be pushed or does not exist."""
        return self._scene.actors.mass(name)

    def bodies_and_poses(self) -> dict[str, tuple[Body, Pose3]]:
        """Return the body and pose of each movable object, sorted by name."""
        return self._scene.actors.bodies_and_poses(self.tick)

    def object_pose(self, name: str) -> Pose3 | None:
        """Return the current pose of an object or robot, or None if it does not exist."""
        if name in self.robots:
            return self.robots[name].base_pose()
        return self._scene.actors.poses(self.tick).get(name)

    def close(self) -> None:
        """Release the engine."""
        for robot in self.robots.values():
            robot.close()
        CLIENT_POOL.release(self._scene.client)
