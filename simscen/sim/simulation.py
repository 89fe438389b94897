"""The world in motion: one robot, what stands, what moves. Time is whole ticks."""

from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt
import pybullet

from simscen.core.case import CLEARANCE_RANGE
from simscen.core.errors import RunError
from simscen.core.events import Event
from simscen.core.geometry import Pose2, Pose3
from simscen.core.motion import Twist
from simscen.core.shapes import Body, MotionPath, TriangleMesh
from simscen.core.trace import Truth
from simscen.sim import engine
from simscen.sim.actors import Actors
from simscen.sim.camera import picture
from simscen.sim.clearance import Clearance
from simscen.sim.contacts import Contacts, Motion, inside, touches
from simscen.sim.drives import build
from simscen.sim.film import Film
from simscen.sim.lost import lost
from simscen.sim.robot_body import RobotBody
from simscen.sim.vehicle import base_twist

FIRMWARE_RATE = 60
"""Hz at which a base's firmware updates its wheel speeds; Clearpath's and Robotis' run at 50 to 100 Hz."""
SETTLING = 60
"""Ticks before tick 0 in which everything comes to rest on the ground."""
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
        clearance_range: float = CLEARANCE_RANGE,
    ) -> None:
        """Build the world with the robot at `pose` at rest.

        Clearance is searched within `clearance_range` metres of the hull.
        `triangulate` gives the surface of a shape, for moving things that the engine has no primitive for.
        """
        self.tick = 0
        self._rate = tick_rate
        self._client = engine.connect(tick_rate, solver_iterations)
        engine.ground(self._client)
        self._static = engine.static_mesh(self._client, static)
        self._film = Film(self._client, static, triangulate)
        self._actors = Actors(self._client, tick_rate, triangulate)
        self._firmware = max(1, round(tick_rate / FIRMWARE_RATE))
        self._base, self._drive = build(self._client, robot, pose, self._firmware / tick_rate)
        for body in sorted(bodies, key=lambda body: body.name):
            self._actors.add(body, 0)
        self._contacts = Contacts(tick_rate)
        self._names: dict[int, str | None] = {}
        self._clearance = Clearance(self._client, tick_rate, static, robot, self._base, self._actors, clearance_range)
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
            if self.tick < self._clearance.no_contact_before and not self._watched():
                pybullet.stepSimulation(client)
                self.tick += 1
            else:
                self._careful_step()

    def _watched(self) -> bool:
        """Whether every step counts: a contact is open, and has to end in time, or something pushes something."""
        return self._contacts.touching or self._actors.pushing

    def _careful_step(self) -> None:
        """A step in which something might touch something; scripted bodies need to be in place only here."""
        self._actors.begin(self.tick)
        if self._clearance.unsure or (self.tick >= self._clearance.no_contact_before and not self._contacts.touching):
            self._clearance.measure(self.tick)
        before = Motion(self._base.pose().position, *self._base.velocity(), self._actors.velocities(self.tick))
        pybullet.stepSimulation(self._client)
        self.tick += 1
        if self._contacts.touching or self.tick > self._clearance.no_contact_before:
            touched = touches(self._client, self._base.id, self._names, self._clearance.owner, 1 / self._rate)
            around = self._clearance.enclosed_by
            if around is not None and around not in {touch.name for touch in touched}:
                touched.append(inside(around, before.origin))
            self._contacts.note(self.tick, touched, before)
        self._actors.show(self.tick)

    def drive(self, command: Twist) -> None:
        """Command a velocity in the base frame; the base follows within its limits."""
        self._drive.command(command)

    def truth(self) -> Truth:
        """The robot as it really is. Raises RunError when the physics has lost it or anything else."""
        pose, velocity = self._base.pose(), self._base.velocity()
        trouble = lost("the robot", *pose, *velocity[0], *velocity[1]) or self._actors.lost(self.tick)
        if trouble is not None:
            raise RunError("diverged", f"simulation diverged at t={self.tick / self._rate:.3f} s: {trouble}")
        clearance, objects = self._clearance.measure(self.tick), self._actors.poses(self.tick)
        if self._contacts.last == self.tick:
            clearance = min(clearance, 0.0)  # surfaces that press on each other may be a hair apart
        return Truth(pose, base_twist(pose, velocity), clearance, objects)

    def _changed(self) -> None:
        """Something was put into or taken out of the world, or set down elsewhere."""
        self._names = {**dict.fromkeys(self._static), **self._actors.ids()}
        self._clearance.forget()

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
        self._clearance.shaken(self.tick)

    def base_pose(self) -> Pose3:
        """The robot's base frame in the world."""
        return self._base.pose()

    def base_velocity(self) -> tuple[Vector, Vector]:
        """Linear (m/s) and angular (rad/s) velocity of the base frame along the world's axes."""
        return self._base.velocity()

    def base_twist(self) -> Twist:
        """The robot's velocity in its own frame."""
        return base_twist(self._base.pose(), self._base.velocity())

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
        self._film.set(self._actors.placed(self.tick))
        return picture(self._client, self._base.pose().compose(mount), width, height, field_of_view, far)

    def close(self) -> None:
        """Give the engine back."""
        self._clearance.close()
        pybullet.disconnect(self._client)
