"""Four mecanum wheels under a planar base: they roll without slip, their rollers without friction."""

import numpy as np

from simscen.core.geometry.kinematics import MecanumWheels, Twist
from simscen.model.robot import Mecanum
from simscen.sim.planar import OmnidirectionalDrive, PlanarBase
from simscen.sim.robot_body import RobotBody


class MecanumDrive(OmnidirectionalDrive):
    """Firmware that reckons with the drive's dimensions, on wheels that are where the body has them."""

    def __init__(self, base: PlanarBase, body: RobotBody, period: float) -> None:
        assert isinstance(body.drive, Mecanum)
        self._firmware, self._wheels = body.drive.wheels, wheels_of(body)
        super().__init__(base, body, period)

    def encoders(self) -> tuple[float, ...]:
        """Angles in rad of the wheels front left, front right, rear left, rear right."""
        return self._wheels.speeds(Twist(*super().encoders()))

    def _driven(self, velocity: Twist) -> Twist:
        return self._wheels.motion(self._firmware.speeds(velocity))


def wheels_of(body: RobotBody) -> MecanumWheels:
    """Wheels with their dimensions as built; a URDF's need not be those of the drive."""
    assert isinstance(body.drive, Mecanum)
    return MecanumWheels(
        radius=float(np.mean([wheel.radius for wheel in body.wheels])),
        half_track=float(np.mean([abs(wheel.y) for wheel in body.wheels])),
        half_base=float(np.mean([abs(wheel.x) for wheel in body.wheels])),
        slant=body.drive.wheels.slant,
    )
