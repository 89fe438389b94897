"""Fakes that replace the simulation in tests of triggers, actions, and sensors."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from simscen.core.clock import Clock
from simscen.core.environment.costmap_filters import ZoneSwitch
from simscen.core.environment.world_model import FloorPatch, WalkingPedestrian
from simscen.core.geometry import Array, Polygon, Pose2, Pose3
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, Path
from simscen.core.random_streams import Streams
from simscen.core.records.events import Event
from simscen.model.robot import Differential


@dataclass
class FakeStage:
    """Fake of core.stage.Stage, the interface of triggers and actions to a run.

    Tests set the fields to describe a situation in the run.

    robot:      true pose of the robot
    twist:      true velocity of the robot in the base frame
    clearance:  true distance in m from the robot to the nearest obstacle; None before the first measurement
    scans:      tick of the newest scan, by name of the lidar
    travelled:  driven distance in m
    objects:    pose of each object, by name; None for an object that does not exist
    motions:    (path, time in s since the start of the motion) of each moving object, by name
    calls:      recorded calls of methods that would change the world: (method name, arguments …)
    """

    tick: int = 0
    clock: Clock = field(default_factory=Clock)
    robot: Pose2 = Pose2(0.0, 0.0, 0.0)
    twist: Twist = STOP
    clearance: float | None = None
    scans: dict[str, int] = field(default_factory=dict)
    travelled: float = 0.0
    belief: Belief | None = None
    events: tuple[Event, ...] = ()
    plan: Path | None = None
    goal: Goal | None = None
    regions: dict[str, Polygon] = field(default_factory=dict)
    objects: dict[str, Pose2 | None] = field(default_factory=dict)
    motions: dict[str, tuple[MotionPath, float]] = field(default_factory=dict)
    calls: list[Any] = field(default_factory=list)

    def last_scan_tick(self, sensor: str | None) -> int | None:
        """Return the tick of the newest scan of the lidar `sensor`, or of all lidars for None; None without a scan."""
        return max(self.scans.values(), default=None) if sensor is None else self.scans.get(sensor)

    @property
    def robots(self) -> tuple[str, ...]:
        """Return no names. The single robot has no name."""
        return ()

    def of(self, robot: str) -> "FakeStage":
        """Return this stage, for any robot."""
        return self

    def region(self, name: str) -> Polygon:
        """Return the corners of a region; without an entry in `regions`, a square of 2 m by 2 m around the origin."""
        return self.regions.get(name, ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))

    def object(self, name: str) -> Pose2 | None:
        """Return the pose of an object; without an entry in `objects`, (0.5, 0.5)."""
        return self.objects.get(name, Pose2(0.5, 0.5, 0.0))

    def motion(self, name: str) -> tuple[MotionPath, float] | None:
        """Return the entry of an object in `motions`; None for an object that does not move."""
        return self.motions.get(name)

    def mass(self, name: str) -> float:
        """Return 1 kg for all objects."""
        return 1.0

    def door(self, name: str) -> tuple[Pose2, Pose2]:
        """Return the closed and open pose of a door that slides by 1 m."""
        return Pose2(0.0, 0.0, 0.0), Pose2(1.0, 0.0, 0.0)

    def spawn(self, body: Body) -> None:
        """Record the call."""
        self.calls.append(("spawn", body))

    def add_pedestrian(self, walker: WalkingPedestrian) -> None:
        """Record the call."""
        self.calls.append(("add_pedestrian", walker))

    def has_room(self, place: tuple[float, float], radius: float, walls_only: bool = False) -> bool:
        """Return True for every place."""
        return True

    def rng(self, name: str) -> np.random.Generator:
        """Return the random stream of seed 1."""
        return Streams(1).generator(name)

    def remove(self, name: str) -> None:
        """Record the call."""
        self.calls.append(("remove", name))

    def move(self, name: str, path: MotionPath) -> None:
        """Record the call."""
        self.calls.append(("move", name, path))

    def place(self, name: str, pose: Pose2) -> None:
        """Record the call."""
        self.calls.append(("place", name, pose))

    def place_robot(self, pose: Pose2) -> None:
        """Record the call."""
        self.calls.append(("place_robot", pose))

    def push(self, impulse: tuple[float, float], name: str | None = None, seconds: float = 0.0) -> None:
        """Record the call."""
        self.calls.append(("push", impulse, name, seconds))

    def add_friction_patch(self, name: str, patch: FloorPatch) -> None:
        """Record the call."""
        self.calls.append(("add_friction_patch", name, patch))

    def send_goal(self, name: str) -> None:
        """Record the call."""
        self.calls.append(("send_goal", name))

    def cancel_goal(self) -> None:
        """Record the call."""
        self.calls.append(("cancel_goal",))

    def switch_zone(self, order: ZoneSwitch) -> str:
        """Record the call."""
        self.calls.append(("switch_zone", order))
        return ""

    def record_world_event(self, event: Event) -> None:
        """Record the call."""
        self.calls.append(("record_world_event", event))

    def record_event(self, event: Event) -> None:
        """Record the call."""
        self.calls.append(("record_event", event))


LINEAR_SPEED_M_S, ANGULAR_SPEED_RAD_S = 0.3, 0.2
"""Speeds of the robot of FakeSensorView."""
ROOM_HALF_WIDTH_M = 4.0
"""Half of the side length of a square room. The center of the room is the origin."""
DIFFERENTIAL_DRIVE = Differential(type="differential", wheel_separation=0.3, wheel_radius=0.05)


class FakeSensorView:
    """Fake of sensors.sensor.SensorView, the interface of sensors to the simulation. The robot drives in a circle.

    Tests set `seconds`, the time since the start of the run in s.
    """

    seconds = 0.0

    def base_pose(self) -> Pose3:
        """Return the pose of the base on a circle around (0, 1.5)."""
        yaw, radius = ANGULAR_SPEED_RAD_S * self.seconds, LINEAR_SPEED_M_S / ANGULAR_SPEED_RAD_S
        return Pose3.planar(Pose2(radius * math.sin(yaw), radius * (1 - math.cos(yaw)), yaw))

    def base_velocity(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Return linear velocity in m/s and angular velocity in rad/s of the base, both in the world frame."""
        yaw = ANGULAR_SPEED_RAD_S * self.seconds
        return (LINEAR_SPEED_M_S * math.cos(yaw), LINEAR_SPEED_M_S * math.sin(yaw), 0.0), (
            0.0,
            0.0,
            ANGULAR_SPEED_RAD_S,
        )

    def placements(self) -> int:
        """Return 0 as the number of kidnappings of the robot."""
        return 0

    def encoders(self) -> tuple[float, ...]:
        """Return the angles of the left and the right wheel in rad."""
        half = DIFFERENTIAL_DRIVE.wheel_separation / 2
        left, right = (LINEAR_SPEED_M_S - ANGULAR_SPEED_RAD_S * half), (LINEAR_SPEED_M_S + ANGULAR_SPEED_RAD_S * half)
        return tuple(speed * self.seconds / DIFFERENTIAL_DRIVE.wheel_radius for speed in (left, right))

    def touching(self) -> bool:
        """Return whether the bumper touches an object: False in the first second, True in the second one, and so on."""
        return int(self.seconds) % 2 == 1

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """Return a gray image (height, width, 3), and depths (height, width) of 2 m, or of `far` if `far` is less."""
        return np.full((height, width, 3), 128, np.uint8), np.full((height, width), min(2.0, far), np.float32)


class SquareRoomRays(RayCaster):
    """Ray caster for the four walls of a square room, see ROOM_HALF_WIDTH_M."""

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """Return the ranges (n,) in m of rays from `origins` (n, 3) along `directions` (n, 3); inf beyond `reach`."""
        with np.errstate(divide="ignore", invalid="ignore"):
            wall_distances = (np.sign(directions[:, :2]) * ROOM_HALF_WIDTH_M - origins[:, :2]) / directions[:, :2]
        ranges: Array = np.nanmin(np.where(wall_distances > 0, wall_distances, np.inf), axis=1)
        return np.where(ranges <= reach, ranges, np.inf)
