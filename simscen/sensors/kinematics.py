"""From what the encoders counted to how far the base moved, if nothing slipped."""

from collections.abc import Callable

from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Drive, Mecanum, Omnidirectional, SkidSteer

Rolled = tuple[float, ...]
_made = tuple.__new__  # a twist without the calls of its class
Kinematics = Callable[[Rolled], Twist]


def kinematics_of(drive: Drive) -> Kinematics:
    """Turns an increment of `SensorView.encoders` into a motion of the base in its own frame (m, m, rad).

    Siegwart, Nourbakhsh and Scaramuzza, Introduction to Autonomous Mobile Robots, section 3.2; mecanum wheels: see
    MecanumWheels.
    """
    if isinstance(drive, Omnidirectional):
        return _omnidirectional
    if isinstance(drive, Mecanum):
        return _mecanum(drive)
    separation = drive.wheel_separation * (drive.turning_scale if isinstance(drive, SkidSteer) else 1.0)
    return _sided(drive.wheel_radius, separation)


def _sided(radius: float, separation: float) -> Kinematics:
    def motion(rolled: Rolled) -> Twist:
        left, right = rolled[0] * radius, rolled[1] * radius
        return _made(Twist, ((left + right) / 2, 0.0, (right - left) / separation))

    return motion


def _mecanum(drive: Mecanum) -> Kinematics:
    def motion(rolled: Rolled) -> Twist:
        front_left, front_right, rear_left, rear_right = rolled
        return drive.wheels.motion((front_left, front_right, rear_left, rear_right))

    return motion


def _omnidirectional(rolled: Rolled) -> Twist:
    return Twist(*rolled)
