"""Specifications of the sensors of a robot (`sensors:` in `*.robot.yaml`)."""

from typing import Annotated, ClassVar

from pydantic import Field

from simscen.core.geometry import Pose3
from simscen.core.records.disturbances import READING_KINDS
from simscen.spec.base import Component, Ranged, Spec, by_default
from simscen.spec.choice import Choice
from simscen.spec.quantities import (
    Angle,
    Duration,
    Frequency,
    Length,
    NonNegativeAcceleration,
    NonNegativeAngle,
    NonNegativeAngularSpeed,
    NonNegativeLength,
    PositiveAngle,
    PositiveLength,
)


class Mount(Spec):
    """Pose of a sensor in the base frame of the robot."""

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
    field_of_view: Annotated[PositiveAngle, Field(le=6.3)] = 6.283185307179586
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
    field_of_view: Annotated[PositiveAngle, Field(le=3.1)] = 1.2
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
