"""Plain PyBullet without simscen, for comparison in `simscen bench`."""

from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.shapes import Solid, TriangleMesh
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import collision_shapes, engine, pybullet
from simscen.sim.bullet.collision_shapes import Triangulate
from simscen.sim.robots.wheeled_base import WheeledBase


class PyBulletBaseline:
    """A robot at rest among static obstacles, simulated with PyBullet only.

    The obstacles are one body if `static` is a mesh, else one body for each solid.
    """

    def __init__(
        self,
        static: TriangleMesh | Sequence[Solid],
        robot: RobotBody,
        pose: Pose2,
        triangulate: Triangulate,
    ) -> None:
        self._client = client = pybullet.connect(pybullet.DIRECT)
        engine.set_physics_parameters(client, tick_rate=240, solver_iterations=10)  # the defaults of Simulation
        ground = self._create_body(pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client))
        pybullet.setCollisionFilterGroupMask(ground, -1, engine.GROUND, engine.EVERYTHING, physicsClientId=client)
        if isinstance(static, TriangleMesh):
            for shape in collision_shapes.create_concave_shapes(client, static.vertices, static.faces):
                mesh = self._create_body(shape)
                pybullet.changeDynamics(mesh, -1, collisionMargin=0.0, physicsClientId=client)
        else:
            for solid in static:
                self._create_body(collision_shapes.create_body_shape(client, [solid], False, triangulate))
        WheeledBase(self._client, robot, pose)
        self._pose = pose

    def _create_body(self, shape: int) -> int:
        """Create a static body in the way that is usual with PyBullet: as a multibody of mass 0."""
        return engine.create_rigid_body(self._client, 0.0, shape, Pose3(), ((0.0, 0.0, 0.0), Pose3()), 1.0)

    def step(self, ticks: int) -> None:
        """Simulate `ticks` ticks."""
        for _ in range(ticks):
            pybullet.stepSimulation(self._client)

    def scan(self, directions: Array, min_range: float, max_range: float, height: float) -> None:
        """Cast rays along unit vectors (n, 2) at a height in m, from `min_range` to `max_range` m from the robot.

        Discards the hits, because only the duration is measured.
        """
        origin = (self._pose.x, self._pose.y)
        starts, ends = np.full((2, len(directions), 3), height)
        starts[:, :2], ends[:, :2] = origin + min_range * directions, origin + max_range * directions
        pybullet.rayTestBatch(starts.tolist(), ends.tolist(), physicsClientId=self._client)

    def close(self) -> None:
        """Disconnect from the engine."""
        pybullet.disconnect(self._client)
