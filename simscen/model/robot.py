"""Specification of robots (`*.robot.yaml`)."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from simscen.core.geometry import Pose3
from simscen.core.geometry.kinematics import MecanumWheels
from simscen.core.records.disturbances import READING_KINDS
from simscen.model.stack_base import RobotLatency
from simscen.spec.base import Component, LanguageVersion, Ranged, Spec, by_default
from simscen.spec.choice import Choice
from simscen.spec.places import Name, PoseSpec, Ring
from simscen.spec.quantities import (
    Angle,
    Duration,
    Frequency,
    Friction,
    Length,
    NonNegativeAcceleration,
    NonNegativeAngle,
    NonNegativeAngularSpeed,
    NonNegativeLength,
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

FilePath = Annotated[str, Field(min_length=1, max_length=4096)]
Argument = Annotated[str, Field(max_length=4096)] | int | float | bool
JointNames = Annotated[list[Name], Field(min_length=1, max_length=20)]


class Differential(Spec):
    """Two driven wheels and casters."""

    type: Literal["differential"]
    """Type of the drive."""
    wheel_radius: PositiveLength
    """Radius of a driven wheel."""
    wheel_separation: PositiveLength
    """Distance between the centers of the two wheels."""
    wheel_width: PositiveLength = 0.03
    """Width of a wheel along its axle."""
    left: JointNames | None = None
    """Wheel joints of the URDF on the left; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""


class SkidSteer(Spec):
    """Fixed wheels on both sides that skid in turns."""

    type: Literal["skid_steer"]
    """Type of the drive."""
    wheel_radius: PositiveLength
    """Radius of a driven wheel."""
    wheel_separation: PositiveLength
    """Distance between the centers of the left and the right wheels."""
    wheel_base: PositiveLength = 0.3
    """Distance between the front and the rear axle."""
    wheel_width: PositiveLength = 0.05
    """Width of a wheel along its axle."""
    left: JointNames | None = None
    """Wheel joints of the URDF on the left; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""
    turning_scale: Annotated[float, Field(gt=0, le=10), Quantity("ratio")] = 1.0
    """Effective wheel separation divided by the geometric wheel separation. It is above 1 because of skidding
    (Clearpath's Jackal: 1.5)."""


class Ackermann(Spec):
    """Car-like drive: rear wheels drive, front wheels steer."""

    type: Literal["ackermann"]
    """Type of the drive."""
    wheel_radius: PositiveLength
    """Radius of a driven wheel."""
    wheel_separation: PositiveLength
    """Distance between the centers of the left and the right wheels."""
    wheel_base: PositiveLength
    """Distance between the front and the rear axle."""
    wheel_width: PositiveLength = 0.04
    """Width of a wheel along its axle."""
    max_steering: PositiveAngle
    """Maximum steering angle of a virtual front wheel in the middle."""
    left: JointNames | None = None
    """Wheel joints of the URDF on the left; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""
    steering: JointNames | None = None
    """Steering joints of the URDF; default: found by position."""


class Omnidirectional(Spec):
    """Idealized drive in any direction, without wheels. Odometry measures every motion."""

    type: Literal["omnidirectional"]
    """Type of the drive."""


class Mecanum(Spec):
    """Drive in any direction with four mecanum wheels. Odometry is computed from the wheel encoders."""

    type: Literal["mecanum"]
    """Type of the drive."""
    wheel_radius: PositiveLength
    """Radius of a driven wheel."""
    wheel_separation: PositiveLength
    """Distance between the centers of the left and the right wheels (track width)."""
    wheel_base: PositiveLength
    """Distance between the front and the rear axle."""
    wheel_width: PositiveLength = 0.05
    """Width of a wheel along its axle."""
    roller_angle: Annotated[Angle, Field(ge=0.1, le=1.4)] = 0.7853981633974483
    """Angle between the axis of a roller and the axle of the wheel."""
    left: JointNames | None = None
    """Wheel joints of the URDF on the left; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""

    @property
    def wheels(self) -> MecanumWheels:
        """Kinematics of the wheels."""
        slant = 1 / math.tan(self.roller_angle)
        return MecanumWheels(self.wheel_radius, self.wheel_separation / 2, self.wheel_base / 2, slant)


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


class Mount(Spec):
    """Pose of a sensor in the base frame of the robot, which is on the ground below the center of the axle."""

    x: Length = 0.0
    """Distance in front of the origin of the base frame."""
    y: Length = 0.0
    """Distance to the left of the origin of the base frame."""
    z: NonNegativeLength = 0.2
    """Height above the ground."""
    roll: Angle = 0.0
    """Angle about the viewing direction; positive: right side down, 180 deg: upside down."""
    pitch: Annotated[Angle, Field(ge=-1.6, le=1.6)] = 0.0
    """Angle of the viewing direction to the horizontal; positive: downward."""
    yaw: Angle = 0.0
    """Horizontal angle of the viewing direction; 0: straight ahead, positive: to the left."""

    @property
    def is_level(self) -> bool:
        """Whether the x-y plane of the sensor is horizontal and not upside down."""
        return self.pose.is_level

    @property
    def pose(self) -> Pose3:
        """Pose of the sensor frame in the base frame."""
        return Pose3.from_rpy(self.x, self.y, self.z, self.roll, self.pitch, self.yaw)


class SensorSpec(Component):
    """Base class of sensor specifications. The component is called with a simscen.sensors.sensor.SensorSetting."""

    reading_type: ClassVar[str]
    """Name of the class of the readings in simscen.core.messages.sensor_data: Scan, Odometry, Imu, Bump, or Image."""
    localizes: ClassVar[bool] = False
    """Whether the localizer uses the scans of this sensor."""

    rate: Frequency = 10.0
    """Rate of the readings."""
    latency: Duration = 0.0
    """Delay between the time stamp of a reading and its arrival at the stack."""

    @classmethod
    def definition_problem(cls) -> str:
        """Return the reason why this class is not a valid specification of a sensor; "" if it is valid."""
        if problem := super().definition_problem():
            return problem
        is_known = getattr(cls, "reading_type", None) in READING_KINDS
        return "" if is_known else f"its `reading_type` is not one of {', '.join(READING_KINDS)}"


class Lidar(Ranged, SensorSpec):
    """Planar lidar."""

    component: ClassVar[str] = "simscen.sensors.lidar:LidarSensor"
    reading_type: ClassVar[str] = "Scan"
    localizes: ClassVar[bool] = True

    rate: Frequency = 10.0
    """Rate of the scans."""
    beams: Annotated[int, Field(ge=1, le=4096)] = 360
    """Number of beams per scan, evenly spread over the field of view."""
    field_of_view: PositiveAngle = 6.283185307179586
    """Field of view, centered on straight ahead."""
    min_range: NonNegativeLength = 0.12
    """Minimum range; a nearer object gives the range -inf."""
    max_range: PositiveLength = 12.0
    """Maximum range; a beam without a nearer object gives the range inf."""
    noise: NonNegativeLength = 0.01
    """Standard deviation of a range."""
    resolution: PositiveLength = 0.001
    """Quantization step of the ranges."""
    mount: Mount = by_default()
    """Pose on the robot."""


class WheelOdometry(SensorSpec):
    """Dead reckoning from wheel encoders, with the error model of Thrun, Probabilistic Robotics, table 5.6."""

    component: ClassVar[str] = "simscen.sensors.odometry:WheelOdometrySensor"
    reading_type: ClassVar[str] = "Odometry"

    rate: Frequency = 40.0
    """Rate of the readings."""
    translation_noise: NonNegativeLength = 0.01
    """Standard deviation of the distance after one meter; the error grows with the square root of the distance."""
    rotation_noise: Annotated[NonNegativeAngle, Field(le=1)] = 0.01
    """Standard deviation of the heading after a turn of one radian."""
    drift_noise: Annotated[NonNegativeAngle, Field(le=1)] = 0.005
    """Standard deviation of the heading after one meter straight ahead."""


class InertialUnit(SensorSpec):
    """Gyroscope and accelerometer."""

    component: ClassVar[str] = "simscen.sensors.imu:ImuSensor"
    reading_type: ClassVar[str] = "Imu"

    rate: Frequency = 60.0
    """Rate of the readings."""
    gyro_noise: Annotated[NonNegativeAngularSpeed, Field(le=10)] = 0.002
    """Standard deviation of the turn rate."""
    gyro_bias: Annotated[NonNegativeAngularSpeed, Field(le=1)] = 0.0005
    """Standard deviation of the gyroscope bias, which is constant in a run."""
    accelerometer_noise: Annotated[NonNegativeAcceleration, Field(le=100)] = 0.02
    """Standard deviation of the acceleration."""
    mount: Mount | None = None
    """Pose on the robot; default: the base frame."""


class Bumper(SensorSpec):
    """Contact sensor that is pressed while the robot touches an object, and for 0.1 s afterwards."""

    component: ClassVar[str] = "simscen.sensors.camera_and_bumper:BumperSensor"
    reading_type: ClassVar[str] = "Bump"

    rate: Frequency = 40.0
    """Rate of the readings."""


class Camera(SensorSpec):
    """Color and depth camera."""

    component: ClassVar[str] = "simscen.sensors.camera_and_bumper:CameraSensor"
    reading_type: ClassVar[str] = "Image"

    rate: Frequency = 5.0
    """Rate of the images."""
    width: Annotated[int, Field(ge=8, le=640)] = 64
    """Width of the image in pixels."""
    height: Annotated[int, Field(ge=8, le=480)] = 48
    """Height of the image in pixels."""
    field_of_view: PositiveAngle = 1.2
    """Horizontal field of view."""
    max_range: PositiveLength = 10.0
    """Maximum range of the depth image."""
    mount: Mount = by_default()
    """Pose on the robot."""


class Sensor(Choice):
    """Sensor of a robot: exactly one of the types below, or of the types that plug-ins add."""

    group: ClassVar[str] = "sensor"

    lidar: Lidar | None = None
    odometry: WheelOdometry | None = None
    imu: InertialUnit | None = None
    bumper: Bumper | None = None
    camera: Camera | None = None

    @property
    def reading_type(self) -> str:
        """Name of the class of the readings in simscen.core.messages.sensor_data."""
        assert isinstance(self.chosen, SensorSpec)
        return self.chosen.reading_type

    @property
    def localizes(self) -> bool:
        """Whether the localizer uses the scans of this sensor."""
        assert isinstance(self.chosen, SensorSpec)
        return self.chosen.localizes

    @property
    def may_render(self) -> bool:
        """Whether the sensor may need the renderer: a camera, or a sensor of a plug-in."""
        return self.original_class is not None or self.reading_type == "Image"


class Part(ShapedObject):
    """Part of the body of the robot."""

    pose: PoseSpec = PoseSpec(x=0.0, y=0.0)
    """Pose in the base frame of the robot."""


class RobotSpec(Spec):
    """Robot: shape, drive, limits, and sensors. Its base frame is on the ground below the center of its axle."""

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
    arguments: Annotated[dict[Name, Argument], Field(max_length=200)] = {}
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
        """Raise ValueError for keys that are missing or exclude each other."""
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
