"""Specification of robots (`*.robot.yaml`)."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from simscen.core.geometry.kinematics import MecanumWheels
from simscen.model.sensors import Sensor
from simscen.model.stack_base import RobotLatency
from simscen.spec.base import LanguageVersion, Spec, by_default
from simscen.spec.places import FilePath, Name, PoseSpec, Ring
from simscen.spec.quantities import (
    Angle,
    Friction,
    PositiveAcceleration,
    PositiveAngle,
    PositiveAngularAcceleration,
    PositiveAngularSpeed,
    PositiveDuration,
    PositiveLength,
    PositiveMass,
    PositiveSpeed,
    Quantity,
)
from simscen.spec.shapes import ShapedObject

XacroArgument = Annotated[str, Field(max_length=4096)] | int | float | bool
JointNames = Annotated[list[Name], Field(min_length=1, max_length=20)]


class WheeledDrive(Spec):
    """Base class of drives with wheels on both sides."""

    type: str
    """Type of the drive."""
    wheel_radius: PositiveLength
    """Radius of a driven wheel."""
    wheel_separation: PositiveLength
    """Distance between the centers of the left and the right wheels (track width)."""
    wheel_width: PositiveLength = 0.05
    """Width of a wheel along its axis."""
    left: JointNames | None = None
    """Wheel joints of the URDF on the left; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""


class Differential(WheeledDrive):
    """Two driven wheels and casters."""

    type: Literal["differential"]
    wheel_width: PositiveLength = 0.03


class SkidSteer(WheeledDrive):
    """Fixed wheels on both sides that skid in turns."""

    type: Literal["skid_steer"]
    wheel_base: PositiveLength = 0.3
    """Distance between the front and the rear wheels."""
    turning_scale: Annotated[float, Field(gt=0, le=10), Quantity("ratio")] = 1.0
    """Effective wheel separation divided by the geometric wheel separation. It is above 1 because of skidding
    (Clearpath's Jackal: 1.5)."""


class Ackermann(WheeledDrive):
    """Car-like drive: rear wheels drive, front wheels steer."""

    type: Literal["ackermann"]
    wheel_width: PositiveLength = 0.04
    wheel_base: PositiveLength
    """Distance between the front and the rear wheels."""
    max_steering: Annotated[PositiveAngle, Field(le=1.5)]
    """Maximum steering angle of a virtual front wheel in the middle."""
    steering: JointNames | None = None
    """Steering joints of the URDF; default: found by position."""


class Mecanum(WheeledDrive):
    """Drive in any direction with four mecanum wheels. Odometry is computed from the wheel encoders."""

    type: Literal["mecanum"]
    wheel_base: PositiveLength
    """Distance between the front and the rear wheels."""
    roller_angle: Annotated[Angle, Field(ge=0.1, le=1.4)] = 0.7853981633974483
    """Angle between the axis of a roller and the axis of its wheel."""

    @property
    def wheels(self) -> MecanumWheels:
        """Kinematics of the wheels."""
        slant = 1 / math.tan(self.roller_angle)
        return MecanumWheels(self.wheel_radius, self.wheel_separation / 2, self.wheel_base / 2, slant)


class Omnidirectional(Spec):
    """Idealized drive in any direction, without wheels. Odometry measures every motion."""

    type: Literal["omnidirectional"]
    """Type of the drive."""


Holonomic = Omnidirectional | Mecanum
"""Drives that can move sideways."""
Drive = Annotated[Differential | SkidSteer | Ackermann | Omnidirectional | Mecanum, Field(discriminator="type")]


class Limits(Spec):
    """Limits of the base. Commands beyond the limits are clipped."""

    linear: PositiveSpeed
    """Maximum forward speed."""
    reverse: PositiveSpeed | None = None
    """Maximum backward speed; default: `linear`."""
    lateral: PositiveSpeed | None = None
    """Maximum sideways speed of an omnidirectional or mecanum base; default: `linear`."""
    angular: PositiveAngularSpeed
    """Maximum turn rate in both directions."""
    linear_acceleration: PositiveAcceleration
    """Maximum acceleration."""
    linear_deceleration: PositiveAcceleration | None = None
    """Maximum deceleration; default: the maximum acceleration."""
    angular_acceleration: PositiveAngularAcceleration
    """Maximum angular acceleration and deceleration."""
    command_timeout: PositiveDuration = 0.5
    """Time without a command after which the base stops (ros2_control's `cmd_vel_timeout`)."""


class Part(ShapedObject):
    """Part of the body of the robot."""

    pose: PoseSpec = PoseSpec(x=0.0, y=0.0)
    """Pose in the base frame of the robot."""


class RobotSpec(Spec):
    """Robot: shape, drive, limits, and sensors.

    The origin of the base frame is on the ground, in the middle between the wheels that do not steer (Ackermann: the
    rear wheels). x points forward, y to the left.
    """

    simscen: LanguageVersion
    """Version of the scenario language."""
    name: Name
    """Name in reports."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """Description for people."""
    urdf: FilePath | None = None
    """URDF or xacro file, relative to this file, instead of `body`."""
    packages: Annotated[dict[Name, FilePath], Field(max_length=100)] = {}
    """Folders of ROS packages by name, relative to this file, for `package://` and `$(find)` in the URDF."""
    arguments: Annotated[dict[Name, XacroArgument], Field(max_length=200)] = {}
    """Values of the `<xacro:arg>` elements of the xacro file, instead of their defaults."""
    body: Annotated[list[Part], Field(min_length=1, max_length=50)] | None = None
    """Simple shapes of the hull; the drive adds the wheels."""
    mass: PositiveMass | None = None
    """Mass of the whole robot; required with `body`."""
    radius: PositiveLength | None = None
    """Radius of the footprint of a round robot."""
    footprint: Ring | None = None
    """Corners of the footprint of any other robot in the base frame; default: computed from the shapes."""
    hull_friction: Friction = 0.5
    """Friction coefficient of the hull. In a contact, it is multiplied by the coefficient of the other body: 1 for
    walls and fixed obstacles, 0.6 for movable obstacles."""
    drive: Drive
    """Wheels and their kinematics."""
    limits: Limits
    """Speed and acceleration limits of the base."""
    sensors: dict[Name, Sensor]
    """Sensors by name; faults refer to these names."""
    latency: RobotLatency = by_default()
    """Computing times and sensor delays of this robot, for scenarios with `stack: {latency: robot}`."""

    @property
    def top_speed(self) -> float:
        """Maximum speed over ground in m/s, in any direction."""
        forward = max(self.limits.linear, self.limits.reverse or self.limits.linear)
        sideways = (self.limits.lateral or self.limits.linear) if isinstance(self.drive, Holonomic) else 0.0
        return float((forward**2 + sideways**2) ** 0.5)

    @property
    def has_imu(self) -> bool:
        """Whether the robot has an IMU."""
        return any(sensor.reading_type == "Imu" for sensor in self.sensors.values())

    @model_validator(mode="after")
    def _check_consistency(self) -> "RobotSpec":
        if unknown := sorted(self.latency.sensors.keys() - self.sensors.keys()):
            raise ValueError(f"`latency` names `{unknown[0]}`, which is not a sensor of the robot")
        if (self.urdf is None) == (self.body is None):
            raise ValueError("expected exactly one of: body, urdf")
        if self.urdf is None and (self.packages or self.arguments):
            raise ValueError("`packages` and `arguments` are only valid with `urdf`")
        if self.body is not None and self.mass is None:
            raise ValueError("`mass` is missing; a robot with a `body` needs it")
        if self.radius is not None and self.footprint is not None:
            raise ValueError("only one of radius, footprint may be given")
        return self
