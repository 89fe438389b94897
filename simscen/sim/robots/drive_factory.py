"""Builds the base and the drive of a robot for any type of drive."""

from simscen.core.geometry import Pose2
from simscen.model.robot import Ackermann, Mecanum, Omnidirectional
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.robots.planar_base import MecanumDrive, OmnidirectionalDrive, PlanarBase
from simscen.sim.robots.wheel_drives import AckermannDrive, DifferentialDrive
from simscen.sim.robots.wheeled_base import WheeledBase
from simscen.sim.scene.scene import Scene

Base = PlanarBase | WheeledBase
"""Hull and wheels of a robot in the engine."""
SimulatedDrive = OmnidirectionalDrive | AckermannDrive | DifferentialDrive
"""Firmware and motors of a base. The specification of a drive is `simscen.model.robot.Drive`.

*Given* any command *then* neither speeds nor accelerations exceed the robot's limits.
*Given* no obstacle and steady commands *then* the base drives what was commanded, except for wheel slip.
*Given* that the robot is placed elsewhere *then* the encoders do not change.
"""


def build_drive(
    scene: Scene, body: RobotBody, pose: Pose2, period: float, visual_shape: int
) -> tuple[Base, SimulatedDrive]:
    """Return the base and drive of a robot at `pose`. The firmware of the drive runs every `period` seconds.

    `visual_shape` is the id of the shape that the renderer shows.
    """
    client, drive = scene.client, body.drive
    if isinstance(drive, Omnidirectional | Mecanum):
        planar_base = PlanarBase(client, body, pose, visual_shape)
        planar_drive_class = MecanumDrive if isinstance(drive, Mecanum) else OmnidirectionalDrive
        return planar_base, planar_drive_class(planar_base, body, period)
    wheeled_base = WheeledBase(client, body, pose, scene.terrain, 1 / scene.tick_rate, visual_shape)
    wheel_drive_class = AckermannDrive if isinstance(drive, Ackermann) else DifferentialDrive
    return wheeled_base, wheel_drive_class(client, wheeled_base, body, period)
