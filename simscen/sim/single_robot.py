"""Simulation of a single robot, for trial drives and tests."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2, Pose3, Vector
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.core.records.case import ROBOT_NAME
from simscen.core.records.events import Event
from simscen.core.records.trace import Truth
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import engine
from simscen.sim.simulation import RobotPlacement, Simulation


class SingleRobotSimulation(Simulation):
    """A simulation with one unnamed robot, whose methods it offers directly; see Robot."""

    def __init__(
        self,
        static: TriangleMesh,
        bodies: Iterable[Body],
        robot: RobotBody,
        pose: Pose2,
        triangulate: engine.Triangulate,
        obstacles: TriangleMesh | None = None,
        **physics: Any,
    ) -> None:
        """Build the world; `physics` are the remaining arguments of Simulation."""
        super().__init__(static, bodies, {ROBOT_NAME: RobotPlacement(robot, pose, obstacles)}, triangulate, **physics)
        self.robot = self.robots[ROBOT_NAME]

    def drive(self, command: Twist) -> None:
        """Command a velocity in the base frame."""
        self.robot.drive(command)

    def truth(self) -> Truth:
        """Return the true state; raises RunError if the physics has diverged."""
        return self.robot.truth()

    def collisions(self) -> tuple[Event, ...]:
        """Return the collision events since the last call."""
        return self.robot.collisions()

    def objects(self) -> Mapping[str, Pose3]:
        """Return the poses of all movable objects."""
        return self.robot.objects()

    def base_pose(self) -> Pose3:
        """Return the pose of the base frame in the world."""
        return self.robot.base_pose()

    def base_velocity(self) -> tuple[Vector, Vector]:
        """Return the linear and angular velocity of the base frame along the world axes."""
        return self.robot.base_velocity()

    def base_twist(self) -> Twist:
        """Return the velocity in the base frame."""
        return self.robot.base_twist()

    def placements(self) -> int:
        """Return how many times the robot was placed elsewhere."""
        return self.robot.placements()

    def encoders(self) -> tuple[float, ...]:
        """Return the accumulated rotation of the wheels."""
        return self.robot.encoders()

    def touching(self) -> bool:
        """Return whether the hull touches anything besides the ground."""
        return self.robot.touching()

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """Return the image of a camera at `mount` in the base frame."""
        return self.robot.image(mount, width, height, field_of_view, far)

    def place_robot(self, pose: Pose2) -> None:
        """Place the robot somewhere else at rest."""
        self.robot.place(pose)

    def push(self, impulse: tuple[float, float]) -> None:
        """Apply an impulse at the center of mass during the next tick."""
        self.robot.push(impulse)
