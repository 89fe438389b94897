"""One robot in a world, and no other: what is driven to try a robot out."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, TriangleMesh
from simscen.core.records.events import Event
from simscen.core.records.trace import Truth
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.bullet import engine
from simscen.sim.robots.robot import Vector
from simscen.sim.simulation import Placed, Simulation

NAMELESS = ""
"""What a robot is called that is the only one."""


class SingleRobotSimulation(Simulation):
    """A simulation whose only robot has no name and need not be asked for."""

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
        """See Simulation, which takes the same `physics`."""
        super().__init__(static, bodies, {NAMELESS: Placed(robot, pose, obstacles)}, triangulate, **physics)
        self.robot = self.robots[NAMELESS]

    def drive(self, command: Twist) -> None:
        """See Robot."""
        self.robot.drive(command)

    def truth(self) -> Truth:
        """See Robot."""
        return self.robot.truth()

    def collisions(self) -> tuple[Event, ...]:
        """See Robot."""
        return self.robot.collisions()

    def objects(self) -> Mapping[str, Pose3]:
        """See Robot."""
        return self.robot.objects()

    def base_pose(self) -> Pose3:
        """See Robot."""
        return self.robot.base_pose()

    def base_velocity(self) -> tuple[Vector, Vector]:
        """See Robot."""
        return self.robot.base_velocity()

    def base_twist(self) -> Twist:
        """See Robot."""
        return self.robot.base_twist()

    def encoders(self) -> tuple[float, ...]:
        """See Robot."""
        return self.robot.encoders()

    def touching(self) -> bool:
        """See Robot."""
        return self.robot.touching()

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """See Robot."""
        return self.robot.image(mount, width, height, field_of_view, far)

    def place_robot(self, pose: Pose2) -> None:
        """See Robot."""
        self.robot.place(pose)

    def push(self, impulse: tuple[float, float]) -> None:
        """See Robot."""
        self.robot.push(impulse)
