"""Helpers of faults: information on the target, simulated readings, the cmd_vel connection, a localizer wrapper."""

from collections.abc import Callable, Collection
from functools import cache

import numpy as np

from simscen.core.clock import Clock
from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Image, Imu, Odometry, Scan
from simscen.core.records.disturbances import KIND_BY_TARGET_NAME
from simscen.faults.base import FaultSetting, SensorSimulator
from simscen.model.disturbances import FaultEntry
from simscen.model.robot import Camera, Mount, RobotSpec
from simscen.sensors.lidar import floor_distances
from simscen.sensors.sensor import SensorView
from simscen.stack.protocols import Localizer

CreateRayCaster = Callable[[TriangleMesh, frozenset[str]], RayCaster]
"""Function that takes the static mesh and names, and creates a ray caster that ignores the moving objects named."""


class FaultSettingFactory:
    """Creates the FaultSetting (information about the affected sensor or actuator) of each fault of one robot."""

    def __init__(
        self,
        robot: RobotSpec,
        clock: Clock,
        now: Callable[[], int],
        view: SensorView,
        mesh: TriangleMesh,
        create_ray_caster: CreateRayCaster,
    ) -> None:
        """`now` returns the current tick. `view` gives true poses and images. `mesh` is the static world."""
        self._robot, self._clock, self._now, self._view = robot, clock, now, view
        self._ray_caster_without = cache(lambda names: create_ray_caster(_without_objects(mesh, names), names))

    def __call__(self, entry: FaultEntry) -> FaultSetting:
        """Return the FaultSetting of a fault in the scenario."""
        sensor = self._robot.sensors.get(entry.sensor)
        return FaultSetting(
            separation=getattr(self._robot.drive, "wheel_separation", 0.0),
            clock=self._clock,
            now=self._now,
            kind=sensor.reading_type if sensor is not None else KIND_BY_TARGET_NAME[entry.sensor],
            simulator=None if sensor is None else self._simulator(entry.sensor, sensor.chosen),
        )

    def _simulator(self, name: str, spec: object) -> SensorSimulator:
        return HypotheticalSensor(spec, self._view, self._ray_caster_without, self._now, name)


def _without_objects(mesh: TriangleMesh, names: frozenset[str]) -> TriangleMesh:
    """Return the mesh without the objects with these names."""
    removed = [number for number, name in enumerate(mesh.names) if name in names]
    kept = ~np.isin(mesh.owners, removed)
    return TriangleMesh(mesh.vertices, mesh.faces[kept], mesh.owners[kept], mesh.names)


CreateRayCasterWithout = Callable[[frozenset[str]], RayCaster]
"""Function that takes names, and returns a ray caster that ignores the static and moving objects named."""


class HypotheticalSensor:
    """Computes what a sensor would measure at another pose, or without some objects. Implements SensorSimulator."""

    def __init__(
        self,
        spec: object,
        view: SensorView,
        ray_caster_without: CreateRayCasterWithout,
        now: Callable[[], int],
        name: str,
    ) -> None:
        """`spec` is the sensor's specification. `view` gives true poses and images. `now` returns the current tick."""
        self._spec, self._view, self._now, self._name = spec, view, now, name
        self._ray_caster_without = ray_caster_without
        mount = getattr(spec, "mount", None)
        self._mount = mount if isinstance(mount, Mount) else Mount()

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """Return the ranges (n,) in m, without noise, that `scan` would have if the lidar's mount had an `error`.

        `error` is a pose in the lidar frame. Beams pass through the objects with the names in `without`.
        """
        pose = self._view.base_pose().compose(self._assumed_mount(error))
        angles = scan.angles()
        flat = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))
        directions = flat @ pose.rotation().T
        origins = np.repeat([pose.position], len(directions), axis=0)
        hits = self._ray_caster_without(frozenset(without)).cast(origins, directions, 2 * scan.range_max)
        if error is None and self._mount.is_level:
            return hits
        return np.minimum(hits, floor_distances(pose.z, directions[:, 2]))

    def image(self, error: Pose3) -> Image:
        """Return the image that the camera would take now if its mount had an `error` (camera frame)."""
        spec = self._spec
        assert isinstance(spec, Camera)
        captured = self._view.image(
            self._assumed_mount(error), spec.width, spec.height, spec.field_of_view, spec.max_range
        )
        return Image(self._name, self._now(), *captured)

    def _assumed_mount(self, error: Pose3 | None) -> Pose3:
        """Return the pose of the sensor in the base frame, displaced by an error."""
        mount_pose = self._mount.pose
        return mount_pose if error is None else mount_pose.compose(error)


class CommandLink:
    """The cmd_vel connection between stack and base.

    The stack sends a message every `period` ticks, and whenever the command changes. The base stops if no message
    arrives for `timeout` ticks, as in ros2_control (`cmd_vel_timeout`). The timeout is at least one period.
    """

    def __init__(self, period: int, timeout: int) -> None:
        """`period` and `timeout` are in ticks."""
        self._period, self._timeout = period, max(period, timeout)
        self._sent: Twist | None = None
        self._received, self._received_at = STOP, 0

    def send(self, tick: int, command: Twist) -> bool:
        """Return whether the stack sends a message with `command` at `tick`. Call it for each command."""
        sent = tick % self._period == 0 or command != self._sent
        self._sent = command
        return sent

    def receive(self, tick: int, command: Twist) -> None:
        """Let the base receive a message at `tick`."""
        self._received, self._received_at = command, tick

    def active_command(self, tick: int) -> Twist:
        """Return the command that the base executes: the last received command, or STOP after the timeout."""
        return self._received if tick - self._received_at <= self._timeout else STOP


class LocalizerWithFaults:
    """Wrapper of the localizer `inner`: `disturb` changes the published beliefs (pose estimates), not its state."""

    def __init__(self, inner: Localizer, disturb: Callable[[Belief], Belief]) -> None:
        self._inner, self._disturb = inner, disturb

    def reset(self, estimate: Estimate) -> None:
        """Reset to an initial estimate."""
        self._inner.reset(estimate)

    def on_odometry(self, odometry: Odometry) -> None:
        """Update with odometry."""
        self._inner.on_odometry(odometry)

    def on_scan(self, scan: Scan) -> None:
        """Update with a lidar scan."""
        self._inner.on_scan(scan)

    def on_imu(self, imu: Imu) -> None:
        """Update with an IMU reading."""
        self._inner.on_imu(imu)

    @property
    def belief(self) -> Belief:
        """Belief with the effects of faults."""
        return self._disturb(self._inner.belief)
