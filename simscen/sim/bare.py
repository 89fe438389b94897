"""PyBullet as one would use it without simscen: what a run is compared with in `simscen bench`."""

from collections.abc import Sequence

import numpy as np
import pybullet

from simscen.core.geometry import Array, Pose2
from simscen.core.shapes import Solid, TriangleMesh
from simscen.sim import engine
from simscen.sim.clients import Clients
from simscen.sim.robot_body import RobotBody
from simscen.sim.vehicle import Vehicle


class BareWorld:
    """A robot at rest among static obstacles, stepped and scanned with nothing but PyBullet.

    The obstacles are one fused mesh, or, given as solids, one body each.
    """

    def __init__(
        self, static: TriangleMesh | Sequence[Solid], robot: RobotBody, pose: Pose2, triangulate: engine.Triangulate
    ) -> None:
        self._client = Clients().take()  # one of its own, which nobody has used
        engine.set_up(self._client, 240, 10)
        if isinstance(static, TriangleMesh):
            engine.static_mesh(self._client, static)
        else:
            for solid in static:
                engine.fixed(self._client, engine.body_shape(self._client, [solid], False, triangulate))
        Vehicle(self._client, robot, pose)
        self._pose = pose

    def step(self, ticks: int) -> None:
        """Step and nothing else."""
        for _ in range(ticks):
            pybullet.stepSimulation(self._client)

    def scan(self, directions: Array, least: float, reach: float, height: float) -> None:
        """Cast rays along `directions` (n, 2), of length 1, between two ranges.

        From the least on, as one does it so that no ray begins in the lidar's own housing: there PyBullet would try
        each against it, which is a third of the time that a scan takes.
        """
        here = (self._pose.x, self._pose.y)
        starts, ends = np.full((2, len(directions), 3), height)
        starts[:, :2], ends[:, :2] = here + least * directions, here + reach * directions
        pybullet.rayTestBatch(starts.tolist(), ends.tolist(), physicsClientId=self._client)

    def close(self) -> None:
        """Leave the engine."""
        pybullet.disconnect(self._client)
