"""Simulation with a single robot."""

from simscen.core.geometry import Pose2
from simscen.core.records.case import SINGLE_ROBOT_NAME
from simscen.sim.simulation import RobotPlacement, Simulation
from simscen.worlds.geometry.triangulation import merge_solids, triangulate


class SingleRobotSimulation(Simulation):
    """A simulation with one robot, which is its attribute `robot`."""

    def __init__(self, body, pose=Pose2(0.0, 0.0, 0.0), solids=(), bodies=(), obstacles=None, **physics):
        """Build the world from static `solids` and movable `bodies`.

        `obstacles` is the part of the static world that counts for the clearance (None: all). `physics` are keyword
        arguments of Simulation.
        """
        robots = {SINGLE_ROBOT_NAME: RobotPlacement(body, pose, obstacles)}
        super().__init__(merge_solids(solids), bodies, robots, triangulate, **physics)
        self.robot = self.robots[SINGLE_ROBOT_NAME]
        self.drive, self.truth = self.robot.drive, self.robot.truth
        self.base_pose, self.encoders = self.robot.base_pose, self.robot.encoders

    def place_robot(self, pose):
        super().place_robot(SINGLE_ROBOT_NAME, pose)

    def push_robot(self, impulse, seconds=0.0):
        super().push_robot(SINGLE_ROBOT_NAME, impulse, seconds)
