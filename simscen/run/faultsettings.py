"""What each fault of a scenario is told of the instance that it affects."""

from collections.abc import Callable
from functools import cache

import numpy as np

from simscen.core.clock import Clock
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.geometry.shapes import TriangleMesh
from simscen.core.records.disturbances import KIND_BY_INSTANCE
from simscen.faults.base import FaultSetting, Sight
from simscen.model.disturbances import FaultEntry
from simscen.model.robot import RobotSpec
from simscen.run.sight import SensorSight
from simscen.sensors.sensor import SensorView

Rays = Callable[[TriangleMesh, frozenset[str]], RayCaster]
"""Makes rays against a mesh that never moves, and against all that does but what is called so."""


class FaultSettings:
    """Makes the setting of each fault of one robot."""

    def __init__(
        self, robot: RobotSpec, clock: Clock, now: Callable[[], int], view: SensorView, mesh: TriangleMesh, rays: Rays
    ) -> None:
        self._robot, self._clock, self._now, self._view = robot, clock, now, view
        self._rays = cache(lambda names: rays(_without(mesh, names), names))

    def __call__(self, entry: FaultEntry) -> FaultSetting:
        """What the fault of an entry may know."""
        sensor = self._robot.sensors.get(entry.sensor)
        return FaultSetting(
            separation=getattr(self._robot.drive, "wheel_separation", 0.0),
            clock=self._clock,
            now=self._now,
            kind=sensor.says if sensor is not None else KIND_BY_INSTANCE[entry.sensor],
            sight=None if sensor is None else self._sight(entry.sensor, sensor.chosen),
        )

    def _sight(self, name: str, spec: object) -> Sight:
        return SensorSight(spec, self._view, self._rays, self._now, name)


def _without(mesh: TriangleMesh, names: frozenset[str]) -> TriangleMesh:
    """The mesh without what is called so."""
    gone = [number for number, name in enumerate(mesh.names) if name in names]
    kept = ~np.isin(mesh.owners, gone)
    return TriangleMesh(mesh.vertices, mesh.faces[kept], mesh.owners[kept], mesh.names)
