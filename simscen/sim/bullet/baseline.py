"""PyBullet as one would use it without simscen: what a run is compared with in `simscen bench`."""

from collections.abc import Sequence

import numpy as np
import pybullet

from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.meshes import submesh
from simscen.core.geometry.shapes import Solid, TriangleMesh
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import engine
from simscen.sim.robots.wheeled_base import WheeledBase


class PyBulletBaseline:
    """A robot at rest among static obstacles, stepped and scanned with nothing but PyBullet.

    The obstacles are one fused mesh, or, given as solids, one body each.
    """

    def __init__(
        self, static: TriangleMesh | Sequence[Solid], robot: RobotBody, pose: Pose2, triangulate: engine.Triangulate
    ) -> None:
        self._client = client = pybullet.connect(pybullet.DIRECT)
        engine.set_physics_parameters(client, 240, 10)
        ground = self._stand(pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client))
        engine.set_collision_filter(client, ground, -1, engine.GROUND, engine.EVERYTHING)
        if isinstance(static, TriangleMesh):
            for lot in engine.tiles(static.vertices, engine.above_floor(static.vertices, static.faces)):
                mesh = self._stand(engine.concave_shape(client, submesh(static.vertices, lot)))
                pybullet.changeDynamics(mesh, -1, collisionMargin=0.0, physicsClientId=client)
        else:
            for solid in static:
                self._stand(engine.body_shape(client, [solid], False, triangulate))
        WheeledBase(self._client, robot, pose)
        self._pose = pose

    def _stand(self, shape: int) -> int:
        """Create a static body with PyBullet's defaults; `engine.create_static_body` makes a faster one."""
        return engine.create_rigid_body(self._client, 0.0, shape, Pose3(), ((0.0, 0.0, 0.0), Pose3()), 1.0)

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
