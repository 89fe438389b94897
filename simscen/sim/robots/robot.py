"""One robot in a simulation: how it moves, what it touches, and how near it is to anything."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from simscen.core.errors import RunError
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.core.records.events import Event
from simscen.core.records.trace import DeferredTruth, Truth
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet.divergence import divergence_reason
from simscen.sim.contact.clearance import Clearance
from simscen.sim.contact.collisions import BaseMotion, CollisionTracker, PreStepMotion, contact_points, enclosed_contact
from simscen.sim.objects.actors import NEVER, Actors
from simscen.sim.objects.proximity import REQUERY_DISTANCE_M, ProximityQuery
from simscen.sim.robots.drive_factory import build_drive
from simscen.sim.robots.robot_state import CachedState, RobotState
from simscen.sim.robots.truth_samples import TruthSampler
from simscen.sim.scene.camera import RenderScene, render_image
from simscen.sim.scene.terrain import FloorFriction, Terrain, is_ground_contact
from simscen.sim.scene.walls import Walls

Vector = tuple[float, float, float]
NOWHERE = (math.inf, math.inf, math.inf)


@dataclass(frozen=True)
class TimedPush:
    """A force on something in the ticks from `since` to before `until`: an `impulse` in N s for each of them."""

    push: Callable[[tuple[float, float]], None]
    impulse: tuple[float, float]
    since: int
    until: int


@dataclass(eq=False)
class Scene:
    """What all robots of a simulation share, and the robots by name."""

    client: int
    rate: int
    walls: Walls
    terrain: Terrain
    actors: Actors
    film: RenderScene | None
    robots: dict[str, "Robot"] = field(default_factory=dict)
    tick: int = 0
    presses: list[TimedPush] = field(default_factory=list)
    floor: FloorFriction = field(default_factory=FloorFriction)

    def hold(self) -> None:
        """Let wheels hold during the next step as the floor does where they are."""
        self.floor.pass_time(self.tick)
        for robot in self.robots.values():
            robot.base.hold(self.floor.friction)

    def press(self) -> bool:
        """Let the forces that last press on during the next step; whether there are any."""
        self.presses = [press for press in self.presses if press.until > self.tick]
        for press in self.presses:
            if press.since <= self.tick:
                press.push(press.impulse)
        if self.presses:
            self.shaken()
        return bool(self.presses)

    def add_press(
        self, push: Callable[[tuple[float, float]], None], impulse: tuple[float, float], seconds: float, since: int
    ) -> None:
        """Spread an impulse in N s evenly over the ticks from `since` on, over one at least."""
        ticks = max(1, round(seconds * self.rate))
        self.presses.append(TimedPush(push, (impulse[0] / ticks, impulse[1] / ticks), since, since + ticks))

    def shaken(self) -> None:
        """Something is pushed during the next step."""
        self.actors.shaken(self.tick)
        for robot in self.robots.values():
            robot.shaken()

    def settle(self) -> None:
        """Something is about to be put into or taken out of the world, or moved: see what is before."""
        for robot in self.robots.values():
            robot.samples.settle()

    def meet(self, anew: bool = False) -> None:
        """Let the engine have what a robot may come near to; asked at every tick at which one looks about itself.

        It is looked `anew` once something has come or gone.
        """
        if self.actors.all_here:
            return
        lookers = [robot.look_out() for robot in self.robots.values() if anew or robot.gone]
        if lookers and (met := self.actors.meet(lookers, self.tick)):
            for robot in self.robots.values():
                robot.know(met)

    def changed(self) -> None:
        """Something was put into or taken out of the world, or set down elsewhere."""
        self.meet(anew=True)
        for robot in self.robots.values():
            robot.changed()


class Robot:
    """A robot: it can be driven and looked at; to the others it is a thing that moves."""

    def __init__(
        self,
        name: str,
        scene: Scene,
        static: TriangleMesh,
        obstacles: TriangleMesh,
        body: RobotBody,
        pose: Pose2,
        period: float,
        reach: float,
        look: int,
    ) -> None:
        """Set down at `pose`; its firmware runs every `period` seconds, clearance is searched within `reach` meters.

        The renderer is shown a `look` of the engine's.

        `obstacles` are what of the `static` world is in its way.
        """
        self.name, self._scene = name, scene
        self.base, self._drive = build_drive(scene.client, body, pose, period, 1 / scene.rate, scene.terrain, look)
        self.advance = self._drive.advance
        """One period of the firmware's loop; for the simulation."""
        self._driven: Twist | None = None
        self._seen = CachedState(self.base.state, scene)
        self._who = f'robot "{name}"' if name else "the robot"
        self.others: tuple[Robot, ...] = ()
        """The other robots, by name."""
        self.bodies: Mapping[str, Body] = {}
        """Everything that may move by name, the same one for as long as nothing comes or goes."""
        self.shape = Body(name, body.solid, Pose3.planar(pose), body.mass)
        self._contacts = CollisionTracker(scene.rate)
        uneven = bool(scene.terrain and self.base.rolling)
        self.clearance = Clearance(
            scene.client, scene.rate, static, obstacles, uneven, body, self.base, self._seen, scene.actors, reach
        )
        self.samples = TruthSampler(self.clearance)
        self._names: dict[int, str | None] = {}
        self._looked_from = NOWHERE

    def drive(self, command: Twist) -> None:
        """Command a velocity in the base frame; the base follows within its limits."""
        if command is not self._driven:  # most commands are the one before, said again
            self._driven = command
            self._drive.command(command)

    def truth(self) -> Truth:
        """The robot as it really is. Raises RunError when the physics has lost it or anything else."""
        tick = self._scene.tick
        return self._truth(tick, self._sound(tick))

    def sample(self, ticks: int) -> Truth | DeferredTruth:
        """The same, to be looked at later; it is asked again after so many ticks. Raises as `truth`."""
        tick = self._scene.tick
        state = self._sound(tick)
        self._scene.actors.look_ahead(tick, ticks)
        if not self._contacts.touching and self.clearance.can_wait(tick, ticks, state.pose):
            return self.samples.take(state, self.objects())
        self.samples.settle()
        return self._truth(tick, state, ticks)

    def _sound(self, tick: int) -> RobotState:
        """Its state. Raises RunError when the physics has lost it or anything else."""
        (x, y, z, i, j, k, w), (vx, vy, vz), (wx, wy, wz) = state = self._seen()
        actors = self._scene.actors
        trouble = divergence_reason(self._who, x, y, z, i + j + k + w + vx + vy + vz + wx + wy + wz)
        if trouble is None and actors.loose:
            trouble = actors.lost(tick)
        if trouble is not None:
            raise RunError("diverged", f"simulation diverged at t={tick / self._scene.rate:.3f} s: {trouble}")
        return state

    def _truth(self, tick: int, state: RobotState, ticks: int = NEVER) -> Truth:
        clearance = self.clearance.measure(tick, ticks)
        if self._contacts.touched(tick):
            clearance = min(clearance, 0.0)  # surfaces that press on each other may be a hair apart
        return Truth(state.pose, state.twist, clearance, self.objects())

    def collisions(self) -> tuple[Event, ...]:
        """collision.started and collision.ended since last asked.

        `robot_caused` says whether the robot itself moved towards what it hit, rather than being hit.
        """
        return self._contacts.take()

    def objects(self) -> Mapping[str, Pose3]:
        """Where everything is that may move, other robots with it."""
        poses = self._scene.actors.poses(self._scene.tick)
        return {**poses, **{robot.name: robot.base_pose() for robot in self.others}} if self.others else poses

    @property
    def homes(self) -> Mapping[str, Pose3]:
        """Where things that can be pushed lay at tick 0, or have come to rest since."""
        return self._scene.actors.homes

    def moving(self) -> Mapping[str, tuple[Body, Pose3]]:
        """Everything that may move and where it is, with its body."""
        return {name: (self.bodies[name], pose) for name, pose in self.objects().items()}

    def base_pose(self) -> Pose3:
        """The robot's base frame in the world."""
        return self._seen().pose

    def base_velocity(self) -> tuple[Vector, Vector]:
        """Linear (m/s) and angular (rad/s) velocity of the base frame along the world's axes."""
        state = self._seen()
        return state.linear, state.angular

    def base_twist(self) -> Twist:
        """The robot's velocity in its own frame."""
        return self._seen().twist

    def encoders(self) -> tuple[float, ...]:
        """What the drive has rolled so far; see `drives.Drive.encoders`."""
        return self._drive.encoders()

    def touching(self) -> bool:
        """Whether the hull touches anything but the ground."""
        return self._contacts.touching

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """What a camera at `mount` in the base frame sees; see `camera.picture`. Only where there are pictures."""
        film = self._scene.film
        assert film is not None, "nobody was to take pictures"
        self._scene.actors.show(self._scene.tick)
        film.set(self.moving())
        return render_image(self._scene.client, self.base_pose().compose(mount), width, height, field_of_view, far)

    def place(self, pose: Pose2) -> None:
        """Set it down somewhere else, at rest."""
        self.settled(pose)
        self._scene.changed()

    def press(self, impulse: tuple[float, float], seconds: float) -> None:
        """Push it evenly from now on for so long: an impulse in N s in the world frame, at its center of mass."""
        self._scene.add_press(self.push, impulse, seconds, self._scene.tick)

    def push(self, impulse: tuple[float, float]) -> None:
        """Push it during the next tick: an impulse in N s in the world frame, at its center of mass."""
        self.base.push(impulse, 1 / self._scene.rate)
        self._scene.shaken()

    # what the simulation tells it

    def settled(self, pose: Pose2) -> None:
        """It stands at `pose`, at rest."""
        self.base.place(pose)
        self._seen.forget()
        self._drive.rest()

    def shaken(self) -> None:
        """Something is pushed during the next step."""
        self.clearance.shaken(self._scene.tick)

    def changed(self) -> None:
        """Something was put into or taken out of the world, or set down elsewhere."""
        scene = self._scene
        self.others = tuple(robot for robot in scene.robots.values() if robot is not self)
        self.clearance.others = [robot.clearance for robot in self.others]
        self.bodies = {**scene.actors.bodies(), **{robot.name: robot.shape for robot in self.others}}
        others = {robot.base.id: robot.name for robot in self.others}
        self._names = {**dict.fromkeys(scene.walls.bodies), **scene.terrain.names, **scene.actors.ids(), **others}
        self.clearance.forget()

    @property
    def gone(self) -> bool:
        """Whether it has moved more than a stride since it looked out."""
        return math.dist(self._looked_from, self._seen().pose[:3]) > REQUERY_DISTANCE_M

    def look_out(self) -> ProximityQuery:
        """Where it is, and how far it looks for what moves."""
        self._looked_from = self._seen().pose.position
        return ProximityQuery(self._looked_from, self.clearance.looks)

    def know(self, bodies: Mapping[int, str | None]) -> None:
        """The engine has these now, too: names by its numbers, None of walls."""
        self._names.update(bodies)

    @property
    def calm_until(self) -> int:
        """The tick until which it cannot touch anything; -1 where a contact is open, and has to end in time."""
        return -1 if self._contacts.touching else self.clearance.no_contact_before

    def look(self) -> BaseMotion:
        """Before a step in which something might touch something: see what is near; how it moves."""
        tick, clearance = self._scene.tick, self.clearance
        if clearance.unsure or (tick >= clearance.no_contact_before and not self._contacts.touching):
            clearance.measure(tick)
        state = self._seen()
        return BaseMotion(state.pose.position, state.linear, state.angular)

    def feel(self, before: PreStepMotion) -> None:
        """After that step: note what is touched."""
        tick, clearance = self._scene.tick, self.clearance
        if not self._contacts.touching and tick <= clearance.no_contact_before:
            return
        touched = contact_points(
            self._scene.client, self.base.id, self._names, clearance.owner, 1 / self._scene.rate, self._stands
        )
        around = clearance.enclosed_by
        if around is not None and around not in {touch.name for touch in touched}:
            touched.append(enclosed_contact(around, before.robot.origin))
        self._contacts.note(tick, touched, before)

    def _stands(self, other: int, link: int, up: float) -> bool:
        """Whether a contact is that of a wheel or caster with the ground."""
        return is_ground_contact(self._scene.terrain.names, self.base.rolling, other, link, up)

    def close(self) -> None:
        """Give back what it has of engines of its own, and look at none any more."""
        self.samples.settle()
        self.clearance.close()
