"""Interfaces of a robot's base and drive, and the function that builds both for any type of drive."""

from collections.abc import Callable, Mapping
from typing import Protocol

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Ackermann, Differential, Mecanum, Omnidirectional, SkidSteer
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.robots.planar_base import MecanumDrive, OmnidirectionalDrive, PlanarBase
from simscen.sim.robots.robot_state import RobotState
from simscen.sim.robots.wheel_drives import AckermannDrive, DifferentialDrive
from simscen.sim.robots.wheeled_base import WheeledBase
from simscen.sim.scene.terrain import Terrain


class Base(Protocol):
    """Hull and wheels of a robot in the engine."""

    id: int
    hull_links: tuple[int, ...]
    """Links that collide with obstacles."""
    ground_links: Mapping[int, float]
    """Smallest z of the contact normal for each link of a wheel or caster that can stand on uneven ground."""

    def place(self, pose: Pose2) -> None:
        """Place the robot at rest on the ground."""
        ...

    def state(self) -> RobotState:
        """Query the current state from the engine."""
        ...

    def set_friction(self, friction: Callable[[float, float], float]) -> None:
        """Set the friction of the wheels; `friction` returns the friction coefficient of the floor at (x, y)."""
        ...

    def push(self, impulse: tuple[float, float], seconds: float) -> None:
        """Apply an impulse (N s, world frame) at the center of mass during the next step, which takes `seconds`."""
        ...


class SimulatedDrive(Protocol):
    """Firmware and motors of a base. The specification of a drive is `simscen.model.robot.Drive`.

    *Given* any command *then* neither speeds nor accelerations exceed the robot's limits.
    *Given* no obstacle and steady commands *then* the base drives what was commanded, except for wheel slip.
    *Given* that the robot is placed elsewhere *then* the encoders do not change.
    """

    def command(self, twist: Twist) -> None:
        """Set the commanded velocity in the base frame."""
        ...

    def advance(self) -> None:
        """Run one period of the firmware: follow the command within the limits."""
        ...

    def rest(self) -> None:
        """Set the current velocity to zero, because the robot was placed at rest."""
        ...

    def encoders(self) -> tuple[float, ...]:
        """Return the accumulated rotation of the wheels; see `SensorView.encoders`."""
        ...


def build_drive(
    client: int, body: RobotBody, pose: Pose2, period: float, tick_seconds: float, terrain: Terrain, visual_shape: int
) -> tuple[Base, SimulatedDrive]:
    """Return the base and drive of a robot at `pose`. The firmware of the drive runs every `period` seconds.

    `visual_shape` is the id of the shape that the renderer shows, `tick_seconds` the duration of a physics step.
    """
    match body.drive:
        case Omnidirectional():
            base = PlanarBase(client, body, pose, visual_shape)
            return base, OmnidirectionalDrive(base, body, period)
        case Mecanum():
            base = PlanarBase(client, body, pose, visual_shape)
            return base, MecanumDrive(base, body, period)
        case Ackermann():
            vehicle = WheeledBase(client, body, pose, terrain, tick_seconds, visual_shape)
            return vehicle, AckermannDrive(client, vehicle, body, period)
        case Differential() | SkidSteer():
            vehicle = WheeledBase(client, body, pose, terrain, tick_seconds, visual_shape)
            return vehicle, DifferentialDrive(client, vehicle, body, period)
