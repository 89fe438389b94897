"""Builds the base and the drive of a robot for any type of drive."""

from simscen.core.geometry import Pose2
from simscen.model.robot import Ackermann, Differential, Mecanum, Omnidirectional, SkidSteer
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.robots.planar_base import MecanumDrive, OmnidirectionalDrive, PlanarBase
from simscen.sim.robots.wheel_drives import AckermannDrive, DifferentialDrive
from simscen.sim.robots.wheeled_base import WheeledBase
from simscen.sim.scene.terrain import Terrain

Base = PlanarBase | WheeledBase
"""Hull and wheels of a robot in the engine."""
SimulatedDrive = OmnidirectionalDrive | AckermannDrive | DifferentialDrive
"""Firmware and motors of a base. The specification of a drive is `simscen.model.robot.Drive`.

*Given* any command *then* neither speeds nor accelerations exceed the robot's limits.
*Given* no obstacle and steady commands *then* the base drives what was commanded, except for wheel slip.
*Given* that the robot is placed elsewhere *then* the encoders do not change.
"""


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
