"""The world in motion: one robot, what stands, what moves. Time is whole ticks."""

import math
from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt
import pybullet

from simscen.core.errors import RunError
from simscen.core.events import Event
from simscen.core.geometry import Pose2, Pose3
from simscen.core.motion import Twist
from simscen.core.shapes import Body, MotionPath, TriangleMesh
from simscen.core.trace import Truth
from simscen.sim import engine
from simscen.sim.actors import Actors
from simscen.sim.camera import picture, show_static
from simscen.sim.contacts import Contacts, Motion, touches
from simscen.sim.drives import build
from simscen.sim.proximity import Proximity
from simscen.sim.robot_body import RobotBody
from simscen.sim.vehicle import base_twist

CLEARANCE_REACH = 2.0
"""How far in metres clearance is searched."""
FIRMWARE_RATE = 60
"""Hz at which a base's firmware updates its wheel speeds; Clearpath's and Robotis' run at 50 to 100 Hz."""
SETTLING = 60
"""Ticks before tick 0 in which everything comes to rest on the ground."""
HORIZON = 0.1
"""Seconds for which a clearance may at most rule out a contact."""

Vector = tuple[float, float, float]


class Simulation:
    """Physics of one run; make it in the process that uses it, and close it."""

    def __init__(
        self,
        static: TriangleMesh,
        bodies: Iterable[Body],
        robot: RobotBody,
        pose: Pose2,
        triangulate: engine.Triangulate,
        tick_rate: int = 240,
        solver_iterations: int = 10,
    ) -> None:
        """Build the world with the robot at `pose` at rest.

        `triangulate` gives the surface of a shape, for moving things that the engine has no primitive for.
        """
        self.tick = 0
        self._rate, self._limits, self._radius = tick_rate, robot.limits, robot.circumscribed_radius
        self._client = engine.connect(tick_rate, solver_iterations)
        engine.ground(self._client)
        self._static = engine.static_mesh(self._client, static)
        self._proximity = Proximity(static, robot, CLEARANCE_REACH)
        self._mesh, self._filmed = static, False
        self._actors = Actors(self._client, tick_rate, triangulate)
        self._firmware = max(1, round(tick_rate / FIRMWARE_RATE))
        self._base, self._drive = build(self._client, robot, pose, self._firmware / tick_rate)
        for body in sorted(bodies, key=lambda body: body.name):
            self._actors.add(body, 0)
        self._contacts = Contacts(tick_rate)
        self._names: dict[int, str | None] = {}
        self._touched: dict[tuple[int, int, int], str] = {}
        self._clearance = 0.0
        self._measured_at, self._no_contact_before = -1, 0
        self._settle(pose)
        self._changed()

    def _settle(self, pose: Pose2) -> None:
        """Let everything sink onto the ground by the few micrometres that it takes."""
        for _ in range(SETTLING):
            pybullet.stepSimulation(self._client)
        self._base.place(pose)
        self._drive.rest()

    def step(self, ticks: int) -> None:
        """Let `ticks` ticks pass."""
        client, until = self._client, self.tick + ticks
        while self.tick < until:
            if self.tick % self._firmware == 0:
                self._drive.advance()
            if self.tick < self._no_contact_before and not self._actors.pushing:
                pybullet.stepSimulation(client)
                self.tick += 1
            else:
                self._careful_step()

    def _careful_step(self) -> None:
        """A step in which something might touch something; scripted bodies need to be in place only here."""
        self._actors.begin(self.tick)
        if self.tick >= self._no_contact_before and not self._contacts.touching:
            self._measure()
        before = Motion(self._base.pose().position, *self._base.velocity(), self._actors.velocities(self.tick))
        pybullet.stepSimulation(self._client)
        self.tick += 1
        if self._contacts.touching or self.tick > self._no_contact_before:
            touched = touches(self._client, self._base.id, self._names, self._owner, 1 / self._rate)
            self._contacts.note(self.tick, touched, before)
        self._actors.show(self.tick)

    def drive(self, command: Twist) -> None:
        """Command a velocity in the base frame; the base follows within its limits."""
        self._drive.command(command)

    def truth(self) -> Truth:
        """The robot as it really is. Raises RunError when the physics has diverged."""
        pose, velocity = self._base.pose(), self._base.velocity()
        if not all(math.isfinite(value) for value in (*pose, *velocity[0], *velocity[1])):
            raise RunError("diverged", f"simulation diverged at t={self.tick / self._rate:.3f} s: the pose is {pose}")
        return Truth(pose, base_twist(pose, velocity), self._measure(), self._actors.poses(self.tick))

    def _measure(self) -> float:
        """Clearance in metres; also works out how long no contact is possible (conservative advancement)."""
        if self._measured_at == self.tick:
            return self._clearance
        self._actors.show(self.tick)
        self._clearance = self._search()
        self._measured_at = self.tick
        free = min(HORIZON, max(0.0, self._clearance - 0.002) / self._fastest())
        self._no_contact_before = self.tick + math.floor(free * self._rate)
        return self._clearance

    def _search(self) -> float:
        """The least distance of the hull to anything, up to CLEARANCE_REACH."""
        robot, client = self._base.id, self._client
        nearest = min(CLEARANCE_REACH, self._proximity.distance(self._base.pose()))
        for other in self._actors.ids():
            for link in self._base.hull_links:
                points = pybullet.getClosestPoints(robot, other, nearest, link, physicsClientId=client)
                nearest = min((point[8] for point in points), default=nearest)
        return nearest

    def _owner(self, place: Vector) -> str:
        """The static solid that is touched at a place; remembered by the centimetre, since contacts last."""
        x, y, z = place
        cell = (round(100 * x), round(100 * y), round(100 * z))
        if cell not in self._touched:
            self._touched[cell] = self._proximity.owner(place)
        return self._touched[cell]

    def _fastest(self) -> float:
        """The greatest speed in m/s at which the hull and anything else can approach each other for a while."""
        limits, (linear, angular) = self._limits, self._base.velocity()
        forward = max(limits.linear, limits.reverse or 0.0, limits.lateral or 0.0, math.hypot(*linear))
        turning = max(limits.angular, math.hypot(*angular)) * self._radius
        return 1.25 * (forward + turning) + self._actors.top_speed() + 0.1

    def _changed(self) -> None:
        """Something was put into or taken out of the world, or set down elsewhere."""
        self._names = {**dict.fromkeys(self._static), **self._actors.ids()}
        self._clearance = 0.0
        self._measured_at, self._no_contact_before = -1, 0

    def collisions(self) -> tuple[Event, ...]:
        """collision.started and collision.ended since last asked.

        `robot_caused` says whether the robot itself moved towards what it hit, rather than being hit.
        """
        return self._contacts.take()

    def spawn(self, body: Body) -> None:
        """Put a body into the world."""
        self._actors.add(body, self.tick)
        self._changed()

    def remove(self, name: str) -> None:
        """Take a body out of the world; unknown names are ignored."""
        self._actors.remove(name)
        self._changed()

    def move(self, name: str, path: MotionPath) -> None:
        """Let a body follow a path that begins now. Raises KeyError for an unknown name."""
        self._actors.move(name, path, self.tick)
        self._changed()

    def object_pose(self, name: str) -> Pose3 | None:
        """Where a body is now; None when it is not there."""
        return self._actors.poses(self.tick).get(name)

    def objects(self) -> Mapping[str, Pose3]:
        """Where everything that may move is now."""
        return self._actors.poses(self.tick)

    def moving(self) -> Mapping[str, tuple[Body, Pose3]]:
        """Everything that may move, and where it is, for a scene of rays."""
        return self._actors.placed(self.tick)

    def place_robot(self, pose: Pose2) -> None:
        """Set the robot down somewhere else, at rest."""
        self._base.place(pose)
        self._drive.rest()
        self._changed()

    def push(self, impulse: tuple[float, float]) -> None:
        """Push the robot during the next tick: an impulse in N s in the world frame, at its centre of mass."""
        self._base.push(impulse, 1 / self._rate)
        self._changed()

    def base_pose(self) -> Pose3:
        """The robot's base frame in the world."""
        return self._base.pose()

    def base_velocity(self) -> tuple[Vector, Vector]:
        """Linear (m/s) and angular (rad/s) velocity of the base frame along the world's axes."""
        return self._base.velocity()

    def encoders(self) -> tuple[float, ...]:
        """What the drive has rolled so far; see `drives.Drive.encoders`."""
        return self._drive.encoders()

    def touching(self) -> bool:
        """Whether the hull touches anything but the ground."""
        return self._contacts.touching

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """What a camera at `mount` in the base frame sees; see `camera.picture`."""
        self._actors.show(self.tick)
        if not self._filmed:
            show_static(self._client, self._mesh)
            self._filmed = True
        return picture(self._client, self._base.pose().compose(mount), width, height, field_of_view, far)

    def close(self) -> None:
        """Give the engine back."""
        self._proximity.close()
        pybullet.disconnect(self._client)
