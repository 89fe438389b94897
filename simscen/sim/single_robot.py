"""Simulation with a single robot, for trial drives and tests."""

from collections.abc import Iterable
from typing import Any

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.core.records.case import ROBOT_NAME
from simscen.core.records.trace import Truth
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet.collision_shapes import Triangulate
from simscen.sim.simulation import RobotPlacement, Simulation


class SingleRobotSimulation(Simulation):
    """A simulation with one robot, which is its attribute `robot`."""

    def __init__(
        self,
        static: TriangleMesh,
        bodies: Iterable[Body],
        robot: RobotBody,
        pose: Pose2,
        triangulate: Triangulate,
        obstacles: TriangleMesh | None = None,
        **physics: Any,
    ) -> None:
        """Build the world. `obstacles` is the part of `static` that counts for the clearance; None for all of it.

        `physics` are keyword arguments of Simulation.
        """
        super().__init__(static, bodies, {ROBOT_NAME: RobotPlacement(robot, pose, obstacles)}, triangulate, **physics)
        self.robot = self.robots[ROBOT_NAME]

    def drive(self, command: Twist) -> None:
        """Command a velocity in the base frame."""
        self.robot.drive(command)

    def truth(self) -> Truth:
        """Return the true state; raises RunError if the physics has diverged."""
        return self.robot.truth()

    def base_pose(self) -> Pose3:
        """Return the pose of the base frame in the world."""
        return self.robot.base_pose()

    def encoders(self) -> tuple[float, ...]:
        """Return the accumulated rotation of the wheels; see `SensorView.encoders`."""
        return self.robot.encoders()

    def place_robot(self, pose: Pose2) -> None:
        """Place the robot at rest at `pose`."""
        self.robot.place(pose)
