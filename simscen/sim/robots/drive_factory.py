"""How velocity commands become motion, for each type of drive."""

from collections.abc import Callable, Mapping
from typing import Protocol

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.model.robot import Ackermann, Differential, Mecanum, Omnidirectional, SkidSteer
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.robots.ackermann import AckermannDrive
from simscen.sim.robots.differential import DifferentialDrive
from simscen.sim.robots.planar_base import MecanumDrive, OmnidirectionalDrive, PlanarBase
from simscen.sim.robots.robot_state import RobotState
from simscen.sim.robots.wheeled_base import WheeledBase
from simscen.sim.scene.terrain import Terrain

Vector = tuple[float, float, float]


class Base(Protocol):
    """A robot in the engine: body `id`, of which the links `hull_links` touch obstacles."""

    id: int
    hull_links: tuple[int, ...]
    rolling: Mapping[int, float]
    """Links that stand on uneven ground, wheels and casters; see `terrain.stands`. None where it knows only z = 0."""

    def place(self, pose: Pose2) -> None:
        """Set it down at rest, its base frame on the ground."""
        ...

    def state(self) -> RobotState:
        """Where it is and how it moves now, asked of the engine."""
        ...

    def hold(self, friction: Callable[[float, float], float]) -> None:
        """Hold on the floor during the next step as its `friction` at x, y in the world lets wheels hold."""
        ...

    def push(self, impulse: tuple[float, float], seconds: float) -> None:
        """Push its center of mass during the next step, which lasts `seconds`: N s along the world's x and y."""
        ...


class Drive(Protocol):
    """The firmware and motors of a base.

    *Given* any command *then* neither speeds nor accelerations exceed the robot's limits.
    *Given* no obstacle and steady commands *then* the base drives what was commanded, within its wheels' slip.
    *Given* that the robot is set down elsewhere *then* the encoders do not notice.
    """

    def command(self, twist: Twist) -> None:
        """Drive this from now on: a velocity in the base frame."""
        ...

    def advance(self) -> None:
        """One period of the firmware's loop: follow the command within the limits."""
        ...

    def rest(self) -> None:
        """The robot was set down at rest."""
        ...

    def encoders(self) -> tuple[float, ...]:
        """What has been rolled so far.

        On wheels: the mean angle in rad of the driven wheels on the left, and of those on the right. Mecanum: the
        angles in rad of the wheels front left, front right, rear left, rear right. Omnidirectional: meters forward,
        meters to the left, and radians.
        """
        ...


def build_drive(
    client: int, body: RobotBody, pose: Pose2, period: float, tick: float, terrain: Terrain, look: int
) -> tuple[Base, Drive]:
    """A robot set down at `pose`, and its drive, whose firmware runs every `period` seconds; a step lasts `tick`.

    The renderer is shown a `look` of the engine's.
    """
    match body.drive:
        case Omnidirectional():
            base = PlanarBase(client, body, pose, look)
            return base, OmnidirectionalDrive(base, body, period)
        case Mecanum():
            base = PlanarBase(client, body, pose, look)
            return base, MecanumDrive(base, body, period)
        case Ackermann():
            vehicle = WheeledBase(client, body, pose, terrain, tick, look)
            return vehicle, AckermannDrive(client, vehicle, body, period)
        case Differential() | SkidSteer():
            vehicle = WheeledBase(client, body, pose, terrain, tick, look)
            return vehicle, DifferentialDrive(client, vehicle, body, period)
