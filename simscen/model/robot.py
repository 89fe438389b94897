"""A robot as a user writes it (`*.robot.yaml`)."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from simscen.core.geometry import Pose3
from simscen.core.geometry.kinematics import MecanumWheels
from simscen.core.records.events import READING_KINDS
from simscen.model.latency import RobotLatency
from simscen.spec.base import Component, LanguageVersion, Ranged, Spec, by_default
from simscen.spec.choice import Choice
from simscen.spec.moving_objects import Shaped
from simscen.spec.places import Name, PoseSpec, Ring
from simscen.spec.quantities import (
    Angle,
    Duration,
    Frequency,
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

FilePath = Annotated[str, Field(min_length=1, max_length=4096)]
Argument = Annotated[str, Field(max_length=4096)] | int | float | bool
JointNames = Annotated[list[Name], Field(min_length=1, max_length=20)]


class Differential(Spec):
    """Two driven wheels and casters."""

    type: Literal["differential"]
    """Which drive it is."""
    wheel_radius: PositiveLength
    """Of a driven wheel."""
    wheel_separation: PositiveLength
    """Between the middles of the two wheels."""
    wheel_width: PositiveLength = 0.03
    """Of a wheel, along its axle."""
    left: JointNames | None = None
    """Wheel joints of the URDF; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""


class SkidSteer(Spec):
    """Fixed wheels on both sides that skid in turns."""

    type: Literal["skid_steer"]
    """Which drive it is."""
    wheel_radius: PositiveLength
    """Of a driven wheel."""
    wheel_separation: PositiveLength
    """Between the middles of the wheels on the left and on the right."""
    wheel_base: PositiveLength = 0.3
    """Between the front and the rear axle."""
    wheel_width: PositiveLength = 0.05
    """Of a wheel, along its axle."""
    left: JointNames | None = None
    """Wheel joints of the URDF on the left; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""
    turning_scale: Annotated[float, Field(gt=0, le=10), Quantity("ratio")] = 1.0
    """Effective over geometric wheel separation; skidding makes it larger than 1 (Clearpath's jackal: 1.5)."""


class Ackermann(Spec):
    """A car: rear wheels drive, front wheels steer."""

    type: Literal["ackermann"]
    """Which drive it is."""
    wheel_radius: PositiveLength
    """Of a driven wheel."""
    wheel_separation: PositiveLength
    """Between the middles of the wheels on the left and on the right."""
    wheel_base: PositiveLength
    """Between the front and the rear axle."""
    wheel_width: PositiveLength = 0.04
    """Of a wheel, along its axle."""
    max_steering: PositiveAngle
    """Of the virtual middle wheel."""
    left: JointNames | None = None
    """Wheel joints of the URDF on the left; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""
    steering: JointNames | None = None
    """Steering joints of the URDF; default: found by position."""


class Omnidirectional(Spec):
    """Moves in any direction (omni wheels, idealised as a planar drive); its odometry sees every motion."""

    type: Literal["omnidirectional"]
    """Which drive it is."""


class Mecanum(Spec):
    """Four mecanum wheels: moves in any direction, with odometry from the wheels' encoders."""

    type: Literal["mecanum"]
    """Which drive it is."""
    wheel_radius: PositiveLength
    """Of a driven wheel."""
    wheel_separation: PositiveLength
    """Between the middles of the wheels on the left and on the right (track width)."""
    wheel_base: PositiveLength
    """Between the front and the rear axle."""
    wheel_width: PositiveLength = 0.05
    """Of a wheel, along its axle."""
    roller_angle: Annotated[Angle, Field(ge=0.1, le=1.4)] = 0.7853981633974483
    """Between a roller's axis and the wheel's axle."""
    left: JointNames | None = None
    """Wheel joints of the URDF; default: found by position."""
    right: JointNames | None = None
    """Wheel joints of the URDF on the right; default: found by position."""

    @property
    def wheels(self) -> MecanumWheels:
        """Their kinematics."""
        slant = 1 / math.tan(self.roller_angle)
        return MecanumWheels(self.wheel_radius, self.wheel_separation / 2, self.wheel_base / 2, slant)


Holonomic = Omnidirectional | Mecanum
"""Drives that can go sideways."""
Drive = Annotated[Differential | SkidSteer | Ackermann | Omnidirectional | Mecanum, Field(discriminator="type")]


class Limits(Spec):
    """What the base can do; commands beyond are clipped, as the firmware of a real base does."""

    linear: PositiveSpeed
    """Forward speed."""
    reverse: PositiveSpeed | None = None
    """Backward speed; default: as forward."""
    lateral: PositiveSpeed | None = None
    """Sideways speed of an omnidirectional or mecanum base; default: as forward."""
    angular: PositiveAngularSpeed
    """Turn rate, either way."""
    linear_acceleration: PositiveAcceleration
    """When it speeds up."""
    linear_deceleration: PositiveAcceleration | None = None
    """Default: as acceleration."""
    angular_acceleration: PositiveAngularAcceleration
    """Of its turn rate, up and down."""
    command_timeout: PositiveDuration = 0.5
    """The base stops when no command came for so long; ros2_control's `cmd_vel_timeout` and its default. Commands stay
    away only where a fault on `cmd_vel` keeps them back."""


class Mount(Spec):
    """Where a sensor sits in the robot's base frame (on the ground under the middle of the axle)."""

    x: Length = 0.0
    """Ahead of the base frame's origin."""
    y: Length = 0.0
    """To the left of it."""
    z: NonNegativeLength = 0.2
    """Above the ground."""
    yaw: Angle = 0.0
    """Where it looks, anticlockwise from straight ahead."""

    @property
    def pose(self) -> Pose3:
        """The sensor's frame in the base frame."""
        return Pose3.from_rpy(self.x, self.y, self.z, 0.0, 0.0, self.yaw)


class CameraMount(Mount):
    """Where a camera sits, and how far it looks down."""

    pitch: Annotated[Angle, Field(ge=-1.6, le=1.6)] = 0.0
    """How far it looks down; negative: up."""

    @property
    def pose(self) -> Pose3:
        """The sensor's frame in the base frame: turned, then tilted, as in URDF."""
        return Pose3.from_rpy(self.x, self.y, self.z, 0.0, self.pitch, self.yaw)


class SensorSpec(Component):
    """A sensor: what it says, and how often. Its component is called with a simscen.sensors.sensor.SensorSetting."""

    says: ClassVar[str]
    """The kind of its readings: Scan, Odometry, Imu, Bump or Image of simscen.core.messages.sensor_data."""
    localizes: ClassVar[bool] = False
    """Whether a localizer matches its scans with the map; all scans show a costmap what is around."""

    rate: Frequency = 10.0
    """How often it says something."""
    latency: Duration = 0.0
    """How long a reading takes from the moment it shows to the stack: exposure, sweep, driver, bus."""

    @classmethod
    def definition_problem(cls) -> str:
        """Why it is no specification of a sensor; "" for one that is."""
        return super().definition_problem() or ("" if getattr(cls, "says", None) in READING_KINDS else _UNSAID)


_UNSAID = f"its `says` is none of {', '.join(READING_KINDS)}"


class Lidar(Ranged, SensorSpec):
    """A planar lidar."""

    component: ClassVar[str] = "simscen.sensors.lidar:LidarSensor"
    says: ClassVar[str] = "Scan"
    localizes: ClassVar[bool] = True

    rate: Frequency = 10.0
    """How often it says something."""
    beams: Annotated[int, Field(ge=1, le=4096)] = 360
    """How many beams a scan has, spread evenly over its field of view."""
    field_of_view: PositiveAngle = 6.283185307179586
    """Centered on straight ahead."""
    min_range: NonNegativeLength = 0.12
    """What is nearer gives no answer."""
    max_range: PositiveLength = 12.0
    """What is further gives no answer."""
    noise: NonNegativeLength = 0.01
    """Standard deviation of a range."""
    resolution: PositiveLength = 0.001
    """Ranges are whole multiples of this."""
    mount: Mount = by_default()
    """Where it sits on the robot."""


class WheelOdometry(SensorSpec):
    """Dead reckoning from the wheels' encoders, with the error model of Thrun, Probabilistic Robotics, table 5.6."""

    component: ClassVar[str] = "simscen.sensors.odometry:WheelOdometrySensor"
    says: ClassVar[str] = "Odometry"

    rate: Frequency = 40.0
    """How often it says something."""
    translation_noise: NonNegativeLength = 0.01
    """Standard deviation of the distance error after one meter driven; errors grow with the square root."""
    rotation_noise: Annotated[NonNegativeAngle, Field(le=1)] = 0.01
    """Standard deviation of the heading error after turning one radian."""
    drift_noise: Annotated[NonNegativeAngle, Field(le=1)] = 0.005
    """Standard deviation of the heading error after driving one meter straight."""


class InertialUnit(SensorSpec):
    """Gyroscope and accelerometer."""

    component: ClassVar[str] = "simscen.sensors.imu:ImuSensor"
    says: ClassVar[str] = "Imu"

    rate: Frequency = 60.0
    """How often it says something."""
    gyro_noise: Annotated[NonNegativeAngularSpeed, Field(le=10)] = 0.002
    """Standard deviation of the turn rate."""
    gyro_bias: Annotated[NonNegativeAngularSpeed, Field(le=1)] = 0.0005
    """Standard deviation of the constant bias of a run."""
    accelerometer_noise: Annotated[NonNegativeAcceleration, Field(le=100)] = 0.02
    """Standard deviation of the acceleration."""


class Bumper(SensorSpec):
    """Pressed while the base touches something."""

    component: ClassVar[str] = "simscen.sensors.camera_and_bumper:BumperSensor"
    says: ClassVar[str] = "Bump"

    rate: Frequency = 40.0
    """How often it says something."""


class Camera(SensorSpec):
    """A color and depth camera."""

    component: ClassVar[str] = "simscen.sensors.camera_and_bumper:CameraSensor"
    says: ClassVar[str] = "Image"

    rate: Frequency = 5.0
    """How often it says something."""
    width: Annotated[int, Field(ge=8, le=640)] = 64
    """Of its image, in pixels."""
    height: Annotated[int, Field(ge=8, le=480)] = 48
    """Of its image, in pixels."""
    field_of_view: PositiveAngle = 1.2
    """Horizontal."""
    max_range: PositiveLength = 10.0
    """What is further has no depth."""
    mount: CameraMount = by_default()
    """Where it sits on the robot, and how far it looks down."""


class Sensor(Choice):
    """One sensor."""

    group: ClassVar[str] = "sensor"

    lidar: Lidar | None = None
    odometry: WheelOdometry | None = None
    imu: InertialUnit | None = None
    bumper: Bumper | None = None
    camera: Camera | None = None

    @property
    def says(self) -> str:
        """The kind of its readings."""
        assert isinstance(self.chosen, SensorSpec)
        return self.chosen.says

    @property
    def localizes(self) -> bool:
        """Whether a localizer matches its scans with the map."""
        assert isinstance(self.chosen, SensorSpec)
        return self.chosen.localizes

    @property
    def takes_pictures(self) -> bool:
        """Whether it may: one of an installed package may look at one whatever it then says."""
        return self.narrow is not None or self.says == "Image"


class Part(Shaped):
    """A piece of the robot's body; `pose` in the base frame."""

    pose: PoseSpec = PoseSpec(x=0.0, y=0.0)
    """Where it is in the robot's base frame."""


class RobotSpec(Spec):
    """A robot: shape, drive, limits, sensors. Its base frame is on the ground under the middle of its axle."""

    simscen: LanguageVersion
    """Version of this language."""
    name: Name
    """What reports call it."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """For people."""
    urdf: FilePath | None = None
    """A URDF (or xacro) file, relative to this one, instead of `body`."""
    packages: Annotated[dict[Name, FilePath], Field(max_length=100)] = {}
    """ROS packages by name: the folder, relative to this file, that `package://` and `$(find)` in the URDF mean."""
    arguments: Annotated[dict[Name, Argument], Field(max_length=200)] = {}
    """What the xacro file's `<xacro:arg>` get in place of their defaults."""
    body: Annotated[list[Part], Field(min_length=1, max_length=50)] | None = None
    """Simple shapes that make up the hull; wheels are added by the drive."""
    mass: PositiveMass | None = None
    """Of the whole robot; needed with `body`."""
    radius: PositiveLength | None = None
    """Of the footprint, for a round robot."""
    footprint: Ring | None = None
    """Corners of the footprint in the base frame, for any other; default: from the shapes."""
    drive: Drive
    """What its wheels are, and how they drive it."""
    limits: Limits
    """What its base can do."""
    sensors: dict[Name, Sensor]
    """By instance name: what faults refer to."""
    latency: RobotLatency = by_default()
    """What computing and sensing take on it, for scenarios that ask for it."""

    @property
    def top_speed(self) -> float:
        """Highest speed over ground in m/s, in the direction in which it drives fastest."""
        ahead = max(self.limits.linear, self.limits.reverse or self.limits.linear)
        sideways = (self.limits.lateral or self.limits.linear) if isinstance(self.drive, Holonomic) else 0.0
        return float((ahead**2 + sideways**2) ** 0.5)

    @model_validator(mode="after")
    def _consistent(self) -> "RobotSpec":
        if strange := sorted(self.latency.sensors.keys() - self.sensors.keys()):
            raise ValueError(f"`latency` names `{strange[0]}`, which is none of its sensors")
        if (self.urdf is None) == (self.body is None):
            raise ValueError("expected exactly one of: body, urdf")
        if self.urdf is None and (self.packages or self.arguments):
            raise ValueError("`packages` and `arguments` are for a `urdf`")
        if self.body is not None and self.mass is None:
            raise ValueError("`mass` is missing; a robot with a `body` needs one")
        if self.radius is not None and self.footprint is not None:
            raise ValueError("only one of radius, footprint may be given")
        return self
