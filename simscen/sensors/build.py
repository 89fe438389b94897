"""From a robot's specification to its sensors."""

from simscen.core.clock import Clock
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.random_streams import Streams
from simscen.model.robot import RobotSpec, SensorSpec
from simscen.sensors.installed import InstalledSensor
from simscen.sensors.sensor import Sensor, SensorSetting, SensorView


def build_sensors(
    spec: RobotSpec, clock: Clock, streams: Streams, view: SensorView, rays: RayCaster
) -> tuple[Sensor, ...]:
    """The robot's sensors in the order of their names, each with its own stream `sensor.<name>`.

    Those of installed packages come last: the log calls the first of a kind by the plain name. Raises ValueError when a
    rate does not divide the clock, RunError where what a package installed is no sensor.
    """
    return tuple(
        _build(name, spec, clock, streams, view, rays)
        for name in sorted(spec.sensors, key=lambda name: (spec.sensors[name].narrow is not None, name))
    )


def _build(name: str, robot: RobotSpec, clock: Clock, streams: Streams, view: SensorView, rays: RayCaster) -> Sensor:
    entry = robot.sensors[name]
    spec = entry.chosen
    assert isinstance(spec, SensorSpec)
    period, chance = clock.period(spec.rate), streams.generator(f"sensor.{name}")
    setting = SensorSetting(name, period, clock.seconds(period), chance, view, rays, robot.drive)
    if entry.narrow is not None:
        return InstalledSensor(entry.kind, spec, setting)
    sensor: Sensor = spec.implementation()(spec, setting)
    return sensor
