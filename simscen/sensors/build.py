"""From a robot's specification to its sensors."""

from simscen.core.chance import Streams
from simscen.core.rays import RayCaster
from simscen.core.time import Clock
from simscen.model.robot import Bumper, Camera, InertialUnit, Lidar, RobotSpec, WheelOdometry
from simscen.sensors.bumper import BumperSensor
from simscen.sensors.camera import CameraSensor
from simscen.sensors.imu import ImuSensor
from simscen.sensors.lidar import LidarSensor
from simscen.sensors.odometry import WheelOdometrySensor
from simscen.sensors.sensor import Sensor, SensorView


def build_sensors(
    spec: RobotSpec, clock: Clock, streams: Streams, view: SensorView, rays: RayCaster
) -> tuple[Sensor, ...]:
    """The robot's sensors in the order of their names, each with its own stream `sensor.<name>`.

    Raises ValueError when a rate does not divide the clock.
    """
    return tuple(_build(name, spec, clock, streams, view, rays) for name in sorted(spec.sensors))


def _build(name: str, robot: RobotSpec, clock: Clock, streams: Streams, view: SensorView, rays: RayCaster) -> Sensor:
    spec = robot.sensors[name].chosen
    assert isinstance(spec, Lidar | WheelOdometry | InertialUnit | Bumper | Camera)
    period = clock.period(spec.rate)
    chance = streams.generator(f"sensor.{name}")
    match spec:
        case Lidar():
            return LidarSensor(name, spec, period, chance, view, rays)
        case WheelOdometry():
            return WheelOdometrySensor(name, spec, period, clock.seconds(period), chance, view, robot.drive)
        case InertialUnit():
            return ImuSensor(name, spec, period, clock.seconds(period), chance, view)
        case Bumper():
            return BumperSensor(name, period, view)
        case Camera():
            return CameraSensor(name, spec, period, view)
