"""What a lidar or a camera would see now if it sat elsewhere, or if something were not there: for faults."""

from collections.abc import Callable, Collection

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.robot import Camera, Mount
from simscen.sensors.sensor import SensorView

Rays = Callable[[frozenset[str]], RayCaster]
"""Gives rays that go through what is called so."""


class SensorSight:
    """Implements faults.base.Sight for one sensor of a robot."""

    def __init__(self, spec: object, view: SensorView, rays: Rays, now: Callable[[], int], name: str) -> None:
        self._spec, self._view, self._rays, self._now, self._name = spec, view, rays, now, name
        mount = getattr(spec, "mount", None)
        self._mount = mount if isinstance(mount, Mount) else Mount()

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """See faults.base.Sight."""
        pose = self._view.base_pose().compose(self._placed(error))
        angles = scan.angles()
        flat = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))
        directions = flat @ pose.rotation().T
        origins = np.repeat([pose.position], len(directions), axis=0)
        hits = self._rays(frozenset(without)).cast(origins, directions, 2 * scan.range_max)
        return hits if error is None else np.minimum(hits, _floor(pose.z, directions[:, 2]))

    def image(self, error: Pose3) -> Image:
        """See faults.base.Sight."""
        spec = self._spec
        assert isinstance(spec, Camera)
        seen = self._view.image(self._placed(error), spec.width, spec.height, spec.field_of_view, spec.max_range)
        return Image(self._name, self._now(), *seen)

    def _placed(self, error: Pose3 | None) -> Pose3:
        thought = self._mount.pose
        return thought if error is None else thought.compose(error)


def _floor(height: float, slopes: Array) -> Array:
    """Where beams from a height end at the floor (z = 0); inf for those that do not point down."""
    down = slopes < -1e-9
    return np.where(down, height / np.where(down, -slopes, 1.0), np.inf)
