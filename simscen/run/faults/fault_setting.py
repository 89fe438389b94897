"""Information about the target of a fault, and simulated readings of a faulty lidar or camera."""

from collections.abc import Callable, Collection
from functools import cache

import numpy as np

from simscen.core.clock import Clock
from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.messages.sensor_data import Image, Scan
from simscen.core.records.disturbances import KIND_BY_TARGET_NAME
from simscen.faults.base import FaultSetting
from simscen.model.disturbances import FaultEntry
from simscen.model.robot import RobotSpec
from simscen.model.sensors import Camera, Mount
from simscen.run.live_world.ray_caster import LiveRayCaster
from simscen.sensors.lidar import floor_distances
from simscen.sim.robots.robot import Robot
from simscen.worlds.raycasting.ray_scene import RayScene


class FaultSettingFactory:
    """Creates the FaultSetting (information about the affected sensor or actuator) of each fault of one robot."""

    def __init__(self, spec: RobotSpec, clock: Clock, now: Callable[[], int], robot: Robot, mesh: TriangleMesh) -> None:
        """`now` returns the current tick. `mesh` is the static world."""
        self._spec, self._clock, self._now, self._robot = spec, clock, now, robot

        @cache
        def ray_caster_without(names: frozenset[str]) -> RayCaster:
            """Return a ray caster that ignores the static and moving objects with these names."""
            ignored = [index for index, name in enumerate(mesh.names) if name in names]
            is_kept = ~np.isin(mesh.owners, ignored)
            static = TriangleMesh(mesh.vertices, mesh.faces[is_kept], mesh.owners[is_kept], mesh.names)
            return LiveRayCaster(RayScene(static), robot, names)

        self._ray_caster_without = ray_caster_without

    def __call__(self, entry: FaultEntry) -> FaultSetting:
        """Return the FaultSetting of a fault in the scenario."""
        sensor = self._spec.sensors.get(entry.sensor)
        return FaultSetting(
            separation=getattr(self._spec.drive, "wheel_separation", 0.0),
            clock=self._clock,
            now=self._now,
            kind=sensor.reading_type if sensor is not None else KIND_BY_TARGET_NAME[entry.sensor],
            simulator=None
            if sensor is None
            else HypotheticalSensor(entry.sensor, sensor.chosen, self._robot, self._now, self._ray_caster_without),
        )


class HypotheticalSensor:
    """Computes what a sensor would measure at another pose, or without some objects. Implements SensorSimulator."""

    def __init__(
        self,
        name: str,
        spec: object,
        robot: Robot,
        now: Callable[[], int],
        ray_caster_without: Callable[[frozenset[str]], RayCaster],
    ) -> None:
        """`now` returns the current tick, and `ray_caster_without` a ray caster that ignores objects by their names."""
        self._name, self._spec, self._robot, self._now = name, spec, robot, now
        self._ray_caster_without = ray_caster_without
        mount = getattr(spec, "mount", None)
        self._mount = mount if isinstance(mount, Mount) else Mount()

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """Return the distance of the first hit of each beam; see SensorSimulator."""
        mount = self._mount.pose if error is None else self._mount.pose.compose(error)
        pose = self._robot.base_pose().compose(mount)
        angles = scan.angles()
        flat = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))
        directions = flat @ pose.rotation().T
        origins = np.repeat([pose.position], len(directions), axis=0)
        hits = self._ray_caster_without(frozenset(without)).cast(origins, directions, 2 * scan.range_max)
        return np.minimum(hits, floor_distances(pose.z, directions[:, 2]))

    def image(self, error: Pose3) -> Image:
        """Return the image that the camera would take now with its mount displaced by `error` (in the camera frame)."""
        spec = self._spec
        assert isinstance(spec, Camera)
        mount = self._mount.pose.compose(error)
        captured = self._robot.image(mount, spec.width, spec.height, spec.field_of_view, spec.max_range)
        return Image(self._name, self._now(), *captured)
