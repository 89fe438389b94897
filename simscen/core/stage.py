"""Interfaces of a run for triggers, which observe it, and actions, which change it."""

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
    """Result of an action: whether it changed anything, and what, or why not."""

    happened: bool
    what: str


class Situation(Protocol):
    """State of the run at one beat, as triggers see it; all poses are in the world frame."""

    @property
    def tick(self) -> int:
        """Simulated time in ticks."""
        ...

    @property
    def clock(self) -> Clock:
        """Conversion between ticks and seconds."""
        ...

    @property
    def robot(self) -> Pose2:
        """True pose of the robot."""
        ...

    @property
    def twist(self) -> Twist:
        """True velocity of the robot in its own frame."""
        ...

    @property
    def clearance(self) -> float | None:
        """Distance in m from the hull to the nearest obstacle at the newest truth sample; None before the first.

        At most the range of the search.
        """
        ...

    def last_scan_tick(self, sensor: str | None) -> int | None:
        """Return the tick at which the stack last received a scan of this lidar (or any), or None."""
        ...

    @property
    def travelled(self) -> float:
        """Distance driven in m, without teleportation."""
        ...

    @property
    def belief(self) -> Belief | None:
        """Latest belief that the stack published."""
        ...

    @property
    def events(self) -> tuple[Event, ...]:
        """All events so far, oldest first."""
        ...

    @property
    def plan(self) -> Path | None:
        """Plan that the robot follows."""
        ...

    @property
    def goal(self) -> Goal | None:
        """Current goal of the robot."""
        ...

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of all robots in order; empty for a single robot."""
        ...

    def of(self, robot: str) -> Situation:
        """Return the state for the robot of this name."""
        ...

    def region(self, name: str) -> Polygon:
        """Return a named region of the world."""
        ...

    def object(self, name: str) -> Pose2 | None:
        """Return the current pose of an object, or None if it does not exist."""
        ...


class Stage(Situation, Protocol):
    """The run as actions change it."""

    def of(self, robot: str) -> Stage:
        """Return the stage for the robot of this name."""
        ...

    def spawn(self, body: Body) -> None:
        """Add a body to physics, ray casting and map pictures from the next tick on."""
        ...

    def add_pedestrian(self, walker: WalkingPedestrian) -> None:
        """Add a pedestrian that walks from the next tick on."""
        ...

    def has_room(self, place: tuple[float, float], radius: float, walls_only: bool = False) -> bool:
        """Return whether a pedestrian of `radius` m fits at `place` without touching anything.

        If `walls_only` is true, only walls count.
        """
        ...

    def rng(self, name: str) -> np.random.Generator:
        """Return a new generator of the random stream with this name."""
        ...

    def remove(self, name: str) -> None:
        """Remove an existing body from the world."""
        ...

    def door(self, name: str) -> tuple[Pose2, Pose2]:
        """Return the poses of a door panel when closed and when open."""
        ...

    def motion(self, name: str) -> tuple[MotionPath, float] | None:
        """Return the path that moves an object now and the seconds since its start; None without a script."""
        ...

    def mass(self, name: str) -> float:
        """Return the mass in kg of an object that can be pushed; 0 for scripted and missing objects."""
        ...

    def move(self, name: str, path: MotionPath) -> None:
        """Move a body along a path that starts now."""
        ...

    def place(self, name: str, pose: Pose2) -> None:
        """Place an object somewhere else at rest and end its script."""
        ...

    def place_robot(self, pose: Pose2) -> None:
        """Place the robot somewhere else at rest without informing the stack."""
        ...

    def push(self, impulse: tuple[float, float], name: str | None = None, seconds: float = 0.0) -> None:
        """Apply an impulse (N s, world frame) at the center of the robot or of an object with a mass.

        It is spread evenly over `seconds`, or over one physics tick for 0.
        """
        ...

    def add_friction_patch(self, name: str, patch: Patch) -> None:
        """Change the friction of a patch of floor; replaces a patch of the same name."""
        ...

    def send_goal(self, name: str) -> None:
        """Preempt the current task with one of the goals that events of the scenario send."""
        ...

    def cancel_goal(self) -> None:
        """Cancel the current goal as an action client would."""
        ...

    def switch_zone(self, order: ZoneSwitch) -> str:
        """Send a zone command to the costmap filters of the stack; return why it had no effect, or ""."""
        ...

    def record_world_event(self, event: Event) -> None:
        """Add an event of the world to the events of all robots; tick 0 stands for now."""
        ...

    def record_event(self, event: Event) -> None:
        """Add an event of this robot; tick 0 stands for now."""
        ...
