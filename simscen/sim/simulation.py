"""The world in motion: robots, what stands, what moves. Time is whole ticks."""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import pybullet

from simscen.core.environment.world_model import Patch
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, MotionPath, TriangleMesh
from simscen.core.records.case import CLEARANCE_RANGE
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import engine
from simscen.sim.bullet.client_pool import CLIENT_POOL
from simscen.sim.contact.collisions import PreStepMotion
from simscen.sim.objects.actors import Actors
from simscen.sim.objects.rest import SAMPLE_COUNT, SAMPLE_PERIOD_TICKS
from simscen.sim.robots.robot import Robot, Scene
from simscen.sim.scene.camera import RenderScene
from simscen.sim.scene.terrain import Terrain
from simscen.sim.scene.walls import Walls

FIRMWARE_RATE = 60
"""Hz at which a base's firmware updates its wheel speeds; Clearpath's and Robotis' run at 50 to 100 Hz."""
HOMING = 5.0
"""Seconds from one look at what lies still to the next: by ticks alone, whoever else looks."""
SETTLING = 60
"""Ticks before tick 0 in which everything comes to rest on the ground."""


class Placed(NamedTuple):
    """A robot, where it starts, and what of the static world is in its way, if that is not all of it."""

    body: RobotBody
    pose: Pose2
    obstacles: TriangleMesh | None = None


class Simulation:
    """Physics of one run; make it in the process that uses it, and close it.

    `robots` are there by name; what drives one and what looks out of it is `Robot`'s.
    """

    def __init__(
        self,
        static: TriangleMesh,
        bodies: Iterable[Body],
        robots: Mapping[str, Placed],
        triangulate: engine.Triangulate,
        tick_rate: int = 240,
        solver_iterations: int = 10,
        clearance_range: float = CLEARANCE_RANGE,
        pictures: bool = True,
    ) -> None:
        """Build the world with the robots at rest where they are placed.

        Neither the order of `robots` nor that of `bodies` matters: the engine gets both by name. Clearance is searched
        within `clearance_range` meters of a hull. `triangulate` gives the surface of a shape, for moving things that
        the engine has no primitive for. Without `pictures` no robot has eyes that take any, and the renderer need not
        be shown anything.
        """
        client = CLIENT_POOL.take()
        engine.set_up(client, tick_rate, solver_iterations, one_by_one=len(robots) > 1)
        terrain = Terrain(client, static, max((w.radius for r in robots.values() for w in r.body.wheels), default=0.0))
        walls = Walls(client, terrain.rest)
        look = engine.AS_IT_IS if pictures else engine.speck(client)
        film = RenderScene(client, static, triangulate) if pictures else None
        actors = Actors(client, tick_rate, triangulate, look, all_present=pictures)
        self._scene = Scene(client, tick_rate, walls, terrain, actors, film)
        self._attends: tuple[int, Callable[[], None]] | None = None
        self._firmware = max(1, round(tick_rate / FIRMWARE_RATE))
        self._homing = math.ceil(HOMING * tick_rate)
        self.robots: dict[str, Robot] = self._scene.robots
        self._each: tuple[Robot, ...] = ()
        for name, (body, pose, obstacles) in sorted(robots.items()):
            period = self._firmware / tick_rate
            ways = static if obstacles is None else obstacles
            self.robots[name] = Robot(name, self._scene, static, ways, body, pose, period, clearance_range, look)
        actors.fill((terrain.lifted(thing) for thing in sorted(bodies, key=lambda body: body.name)), 0)
        self._scene.meet()
        if not walls.complete:
            self._put_up_walls(SETTLING)
        settling = actors.settling()
        for tick in range(1 - SETTLING, 1):
            if tick == 0:
                actors.lay(settling.at_rest())
            pybullet.stepSimulation(client)
            if -SAMPLE_PERIOD_TICKS * SAMPLE_COUNT <= tick < 0 and tick % SAMPLE_PERIOD_TICKS == 0:
                settling.look()
        actors.settled(0)
        for name, robot in self.robots.items():
            robot.settled(robots[name].pose)
        self._each = tuple(self.robots.values())
        self._scene.changed()

    @property
    def tick(self) -> int:
        """Ticks since the start."""
        return self._scene.tick

    def step(self, ticks: int) -> None:
        """Let `ticks` ticks pass."""
        scene, until = self._scene, self._scene.tick + ticks
        if scene.actors.loose:
            for due in range(scene.tick - scene.tick % self._homing + self._homing, until + 1, self._homing):
                self._step(due - scene.tick)
                scene.actors.settled(due)
        if scene.tick < until:
            self._step(until - scene.tick)
        scene.meet()

    def _step(self, ticks: int) -> None:
        scene, calm = self._scene, -1
        until, plain = scene.tick + ticks, not (scene.presses or self._attends or scene.floor)
        if plain and (calm := self._calm_until(ticks)) >= until:
            self._step_calmly(until)
            return
        while scene.tick < until:
            if scene.tick >= calm:
                calm = self._calm_until(ticks)
            if plain and scene.tick < calm:
                self._step_calmly(min(until, calm))
                continue
            if self._attends is not None and scene.tick % self._attends[0] == 0:
                self._attends[1]()
            if scene.tick % self._firmware == 0:
                for robot in self._each:
                    robot.advance()
            if scene.floor:
                scene.hold()
            if scene.presses and scene.press():
                calm = -1
            if scene.tick < calm:
                pybullet.stepSimulation(scene.client)
                scene.tick += 1
            else:
                self._careful_step()

    def _step_calmly(self, until: int) -> None:
        scene, tick = self._scene, self._scene.tick
        while tick < until:
            if tick % self._firmware == 0:
                scene.tick = tick
                for robot in self._each:
                    robot.advance()
            pybullet.stepSimulation(scene.client)
            tick += 1
        scene.tick = tick

    def _calm_until(self, ticks: int) -> int:
        """The tick until which no step counts; -1 where each does, as where something pushes something.

        For so many ticks, the walls stand that what is loose may come to meanwhile.
        """
        actors = self._scene.actors
        if not actors.loose:
            return min([robot.calm_until for robot in self._each])
        if not self._scene.walls.complete:
            self._put_up_walls(ticks)
        calm = min([robot.calm_until for robot in self._each])
        return min(calm, actors.apart_until(self._scene.tick, self._fastest))

    def _fastest(self) -> float:
        return max([robot.clearance.own_speed() for robot in self._each])

    def _careful_step(self) -> None:
        """A step in which something might touch something; scripted bodies need to be in place only here."""
        scene = self._scene
        if scene.tick < min([robot.calm_until for robot in self._each]):  # only things may touch each other
            scene.actors.begin(scene.tick, everything=False)
            pybullet.stepSimulation(scene.client)
            scene.tick += 1
            scene.actors.show(scene.tick, everything=False)
            return
        scene.meet()
        scene.actors.begin(scene.tick)
        motions = {robot.base.id: robot.look() for robot in self.robots.values()}
        if not scene.walls.complete:
            self._put_up_walls(1)
        others = scene.actors.velocities(scene.tick)
        pybullet.stepSimulation(scene.client)
        scene.tick += 1
        for robot in self.robots.values():
            robot.feel(PreStepMotion(motions[robot.base.id], others, motions))
        scene.actors.show(scene.tick)

    def _put_up_walls(self, ticks: int) -> None:
        """Those that anything could touch within the next ticks, robots only if they are not calm."""
        scene = self._scene
        near = [(robot.base.id, robot.base_pose().position, robot.clearance.size) for robot in self.robots.values()]
        for body in itertools.chain(near, scene.actors.coming(scene.tick, ticks)):
            if fresh := scene.walls.near(*body):
                for robot in self.robots.values():
                    robot.know(dict.fromkeys(fresh))

    def lay(self, name: str, patch: Patch) -> None:
        """Make a piece of floor slippery, or dry again; a patch of the same name is replaced."""
        self._scene.floor.lay(name, patch)

    def spawn(self, body: Body) -> None:
        """Put a body into the world."""
        self._scene.settle()
        self._scene.actors.add(self._scene.terrain.lifted(body), self.tick)
        self._scene.changed()

    def remove(self, name: str) -> None:
        """Take a body out of the world; unknown names are ignored."""
        self._scene.settle()
        self._scene.actors.remove(name)
        self._scene.changed()

    def move(self, name: str, path: MotionPath) -> None:
        """Let a body follow a path that begins now. Raises KeyError for an unknown name."""
        self._scene.settle()
        self._scene.actors.move(name, path, self.tick)
        self._scene.changed()

    def place(self, name: str, pose: Pose2) -> None:
        """Set a body down somewhere else, at rest; no path moves it any more. Raises KeyError for an unknown name."""
        self._scene.settle()
        self._scene.actors.place(name, pose, self.tick)
        self._scene.changed()

    def motion(self, name: str) -> tuple[MotionPath, float] | None:
        """The path that moves a body now, and the seconds since it was set off; None when none does."""
        return self._scene.actors.motion(name, self.tick)

    def mass(self, name: str) -> float:
        """In kg, of a body that can be pushed; 0 of anything else."""
        return self._scene.actors.mass(name)

    def push_object(self, name: str, impulse: tuple[float, float], seconds: float = 0.0) -> None:
        """Push a body evenly for so long, or for one tick, from the next tick on: N s in the world frame.

        What cannot be pushed, or is gone, is not.
        """
        actors = self._scene.actors
        actors.wake(name)
        self._scene.add_press(partial(actors.push, name), impulse, seconds, self.tick + 1)

    def attend(self, period: int, act: Callable[[], None]) -> None:
        """Have something done before each step from a tick that is a multiple of `period`."""
        self._attends = period, act

    def come(self, body: Body, speed: float) -> None:
        """Let a round body come that `follow` will move, never faster than `speed` in m/s."""
        self._scene.settle()
        path = MotionPath((0.0,), (body.pose.plane,))
        self._scene.actors.add(replace(body, path=path), self.tick, led=True)
        self._scene.actors.follow(body.name, path, speed, self.tick)
        self._scene.changed()

    def follow(self, name: str, path: MotionPath, speed: float) -> None:
        """Let what came so follow a path that begins where it is now."""
        self._scene.actors.follow(name, path, speed, self.tick)

    def things(self) -> dict[str, tuple[Body, Pose3]]:
        """Everything that may move but robots, and where it is, by name in order."""
        return self._scene.actors.placed(self.tick)

    def object_pose(self, name: str) -> Pose3 | None:
        """Where a body is now, or a robot; None when it is not there."""
        if name in self.robots:
            return self.robots[name].base_pose()
        return self._scene.actors.poses(self.tick).get(name)

    def close(self) -> None:
        """Give the engine back."""
        for robot in self.robots.values():
            robot.close()
        CLIENT_POOL.give_back(self._scene.client)
