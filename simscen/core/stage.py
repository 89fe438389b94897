"""What triggers may look at and what actions may touch while a scenario runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from simscen.core.clock import Clock
from simscen.core.environment.costmap_filters import ZoneSwitch
from simscen.core.environment.world_model import Patch, Polygon, WalkingPedestrian
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.core.messages.navigation import Belief, Goal, Path
from simscen.core.records.events import Event

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Effect:
    """What came of an action: whether anything is different now, and what, or why nothing is."""

    happened: bool
    what: str


class Situation(Protocol):
    """The run as a trigger sees it at one beat; everything in the world frame."""

    @property
    def tick(self) -> int:
        """Simulated time in whole ticks."""
        ...

    @property
    def clock(self) -> Clock:
        """What makes ticks of seconds."""
        ...

    @property
    def robot(self) -> Pose2:
        """The true pose of the robot."""
        ...

    @property
    def twist(self) -> Twist:
        """The true velocity of the robot in its own frame."""
        ...

    @property
    def clearance(self) -> float | None:
        """Meters from the robot's hull to the nearest obstacle by the newest sample of the truth, None before that.

        What is further than was searched for is said to be that far.
        """
        ...

    def scanned(self, sensor: str | None) -> int | None:
        """The tick at which the stack last received a scan of this lidar, or of any; None before the first."""
        ...

    @property
    def travelled(self) -> float:
        """Meters driven so far; being set down elsewhere is no drive."""
        ...

    @property
    def belief(self) -> Belief | None:
        """What the stack last said about its pose."""
        ...

    @property
    def events(self) -> tuple[Event, ...]:
        """Everything that has happened so far, oldest first."""
        ...

    @property
    def plan(self) -> Path | None:
        """The plan the robot is following."""
        ...

    @property
    def goal(self) -> Goal | None:
        """The goal the robot is driving to."""
        ...

    @property
    def robots(self) -> tuple[str, ...]:
        """The names of all robots, in order; none where there is one only."""
        ...

    def of(self, robot: str) -> Situation:
        """The same run as it concerns the robot of this name."""
        ...

    def region(self, name: str) -> Polygon:
        """A named region of the world."""
        ...

    def object(self, name: str) -> Pose2 | None:
        """Where a named object is now; None when it is not there."""
        ...


class Stage(Situation, Protocol):
    """The run as an action may change it."""

    def of(self, robot: str) -> Stage:
        """The same run as it concerns the robot of this name."""
        ...

    def spawn(self, body: Body) -> None:
        """Put a new body into the world: physics, rays and picture see it from the next tick on."""
        ...

    def walk(self, walker: WalkingPedestrian) -> None:
        """Let somebody come who walks by themselves from the next tick on."""
        ...

    def room(self, place: tuple[float, float], radius: float, walls_only: bool = False) -> bool:
        """Whether a person of a radius in meters can stand there: no wall is in the way, no thing, person or robot."""
        ...

    def chance(self, name: str) -> np.random.Generator:
        """The random stream of this name, anew each time it is asked for."""
        ...

    def remove(self, name: str) -> None:
        """Take a body out of the world; it has to be there."""
        ...

    def door(self, name: str) -> tuple[Pose2, Pose2]:
        """The poses of a door's panel when closed and when open."""
        ...

    def motion(self, name: str) -> tuple[MotionPath, float] | None:
        """The path that moves an object now, and the seconds since it was set off; None when no script moves it."""
        ...

    def mass(self, name: str) -> float:
        """The mass in kg of an object that can be pushed; 0 of one that only a script moves, or that is not there."""
        ...

    def move(self, name: str, path: MotionPath) -> None:
        """Let a body follow a path that begins now."""
        ...

    def place(self, name: str, pose: Pose2) -> None:
        """Set an object down somewhere else, at rest; no script moves it any more."""
        ...

    def place_robot(self, pose: Pose2) -> None:
        """Set the robot down somewhere else, at rest; the stack is not told."""
        ...

    def push(self, impulse: tuple[float, float], name: str | None = None, seconds: float = 0.0) -> None:
        """Push the robot, or an object with a mass: an impulse in N s in the world frame, at its center.

        It is spread evenly over so many `seconds`; over one tick of the physics for 0.
        """
        ...

    def lay(self, name: str, patch: Patch) -> None:
        """Make a piece of floor slippery, or dry again; a patch of the same name is replaced."""
        ...

    def send_goal(self, name: str) -> None:
        """Preempt what the robot is doing with one of the goals that the scenario's events send."""
        ...

    def cancel_goal(self) -> None:
        """Cancel the current goal as an action client would."""
        ...

    def switch_zone(self, order: ZoneSwitch) -> str:
        """Tell the stack that a zone of its costmap filters is on or off; why nothing came of it, or ""."""
        ...

    def tell(self, event: Event) -> None:
        """Write an event to the logs of all robots: it happened to the world."""
        ...

    def note(self, event: Event) -> None:
        """Write an event to the log."""
        ...
