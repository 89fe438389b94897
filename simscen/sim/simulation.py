"""Physics simulation of one run: robots, static world, and movable objects. A tick is one physics step."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from simscen.core.environment.world_model import FloorPatch
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, MotionPath, TriangleMesh
from simscen.core.records.case import CLEARANCE_RANGE_M
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import engine
from simscen.sim.bullet.client_pool import CLIENT_POOL
from simscen.sim.bullet.collision_shapes import Triangulate
from simscen.sim.objects.actors import Actors
from simscen.sim.robots.robot import Robot
from simscen.sim.scene.camera import RenderScene
from simscen.sim.scene.scene import Scene
from simscen.sim.scene.terrain import Terrain
from simscen.sim.scene.walls import Walls
from simscen.sim.stepping import Stepper

FIRMWARE_RATE_HZ = 60
"""Rate at which the firmware of a robot's base updates the wheel speeds."""


class RobotPlacement(NamedTuple):
    """Body and initial pose of a robot.

    `obstacles` is the part of the static world that counts for the clearance of the robot (None: all of it).
    """

    body: RobotBody
    pose: Pose2
    obstacles: TriangleMesh | None = None


class Simulation:
    """Physics of one run. Create a simulation in the process that uses it, and call `close` after use.

    A movable object is given as a `Body`; `simscen.sim.objects` calls it an actor.
    """

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
        self._scene = scene = Scene(client, tick_rate, walls, terrain, actors, render_scene)
        firmware_period = max(1, round(tick_rate / FIRMWARE_RATE_HZ))
        self.robots: dict[str, Robot] = {}
        """Robots by name, sorted."""
        for name, (body, pose, counted) in sorted(robots.items()):
            obstacles = static if counted is None else counted
            period = firmware_period / tick_rate
            self.robots[name] = Robot(name, scene, static, obstacles, body, pose, period, clearance_range, visual_shape)
        actors.add_all((terrain.raise_to_ground(body) for body in sorted(bodies, key=lambda body: body.name)), 0)
        self._stepper = Stepper(scene, self.robots.values(), firmware_period)
        self._stepper.settle()
        with self._stepper.change():  # settling has moved the robots
            for name, robot in self.robots.items():
                robot.set_pose(robots[name].pose)

    @property
    def tick(self) -> int:
        """Ticks since the start."""
        return self._scene.tick

    def step(self, ticks: int) -> None:
        """Simulate `ticks` ticks."""
        self._stepper.step(ticks)

    def call_before_steps(self, period: int, function: Callable[[], None]) -> None:
        """Call `function` before each step that begins at a multiple of `period` ticks.

        Replaces the previous function.
        """
        self._stepper.call_before_steps(period, function)

    # Changing the world

    def add_friction_patch(self, name: str, patch: FloorPatch) -> None:
        """Change the friction of an area of the floor; replaces a patch of the same name."""
        self._scene.floor.add(name, patch)

    def spawn(self, body: Body) -> None:
        """Add a body to the world."""
        with self._stepper.change():
            self._scene.actors.add(self._scene.terrain.raise_to_ground(body), self.tick)

    def remove(self, name: str) -> None:
        """Remove a body from the world; unknown names are ignored."""
        with self._stepper.change():
            self._scene.actors.remove(name)

    def move(self, name: str, path: MotionPath) -> None:
        """Let a body follow a path from now on; the body cannot be pushed any more.

        Raises KeyError for an unknown name.
        """
        with self._stepper.change():
            self._scene.actors.move(name, path, self.tick)

    def place(self, name: str, pose: Pose2) -> None:
        """Place a body at rest at `pose`, and end its path. The body keeps its initial height above the ground.

        Raises KeyError for an unknown name.
        """
        initial = self._scene.actors.bodies()[name].pose
        old_ground, new_ground = self._scene.terrain.heights(np.array([initial[:2], pose[:2]])).tolist()
        with self._stepper.change():
            self._scene.actors.place(name, Pose3.planar(pose, initial.z - old_ground + new_ground), self.tick)

    def push_object(self, name: str, impulse: tuple[float, float], seconds: float = 0.0) -> None:
        """Apply an impulse (N s, world frame) to a body, spread over `seconds`.

        The push begins one tick later, because a sleeping body must wake first. Has no effect on a body that does not
        exist or cannot be pushed.
        """
        actors = self._scene.actors
        actors.wake(name)
        self._stepper.add_push(partial(actors.push, name), impulse, seconds, self.tick + 1)

    def place_robot(self, name: str, pose: Pose2) -> None:
        """Place a robot at rest at `pose`, and end the collisions at its old pose."""
        with self._stepper.change():
            self.robots[name].place(pose)

    def push_robot(self, name: str, impulse: tuple[float, float], seconds: float = 0.0) -> None:
        """Apply an impulse (N s, world frame) at a robot's center of mass, spread over `seconds` from now on.

        If `seconds` is 0, the step that begins now applies the whole impulse.
        """
        push = self.robots[name].push
        if seconds:
            self._stepper.add_push(push, impulse, seconds, self.tick)
        else:
            push(impulse)
            self._stepper.on_push()

    def add_steered_body(self, body: Body, max_speed: float) -> None:
        """Add a body with a circular outline, such as a pedestrian. `follow` can move it at up to `max_speed` m/s."""
        path = MotionPath((0.0,), (body.pose.plane,))
        with self._stepper.change():
            self._scene.actors.add(replace(body, path=path), self.tick, is_steered=True)
            self._scene.actors.follow(body.name, path, max_speed, self.tick)

    def follow(self, name: str, path: MotionPath, max_speed: float) -> None:
        """Let a body that `add_steered_body` added follow a path, which must begin at the pose of the body.

        The path must not exceed `max_speed` m/s.
        """
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
        return self._scene.actors.poses.at(self.tick).get(name)

    def close(self) -> None:
        """Release the engine."""
        for robot in self.robots.values():
            robot.close()
        CLIENT_POOL.release(self._scene.client)
