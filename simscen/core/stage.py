"""Interfaces to a running simulation: triggers observe it through `Situation`, actions change it through `Stage`.

Poses are in the world frame. Only the estimated pose (belief) and the plan are in the map frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from simscen.core.clock import Clock
from simscen.core.environment.costmap_filters import ZoneSwitch
from simscen.core.environment.world_model import FloorPatch, WalkingPedestrian
from simscen.core.geometry import Polygon, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, Path
from simscen.core.records.events import Event

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np


@dataclass(frozen=True)
class Effect:
    """Result of an action.

    `happened` states whether the action made the requested change completely; False if only a part was possible.
    `what` is a text: the change, or the reason why the action did not make the change.
    """

    happened: bool
    what: str


class Situation(Protocol):
    """Current state of the run and of one robot, for triggers."""

    @property
    def tick(self) -> int:
        """Current simulated time in ticks."""

    @property
    def clock(self) -> Clock:
        """Conversion between ticks and seconds."""

    @property
    def robot(self) -> Pose2:
        """True pose of the robot."""

    @property
    def twist(self) -> Twist:
        """True velocity of the robot in the base frame."""

    @property
    def clearance(self) -> float | None:
        """True distance in m from the robot to the nearest obstacle; None before the first measurement.

        The distance is at most the measuring range (`Case.clearance_range`).
        """

    def last_scan_tick(self, sensor: str | None) -> int | None:
        """Return the tick at which the stack last received a scan of the lidar `sensor`; None if it received none.

        If `sensor` is None, scans of all lidars count.
        """

    @property
    def travelled(self) -> float:
        """Distance driven so far in m, without teleportation."""

    @property
    def belief(self) -> Belief | None:
        """Newest pose estimate that the stack published; None before the first one."""

    @property
    def events(self) -> Sequence[Event]:
        """All events so far, oldest first."""

    @property
    def plan(self) -> Path | None:
        """Plan that the robot follows; None if it follows none."""

    @property
    def goal(self) -> Goal | None:
        """Goal that the robot drives to; None if there is none."""

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of all robots in order; empty for a single robot."""

    def of(self, robot: str) -> Situation:
        """Return the situation of the robot with this name."""

    def region(self, name: str) -> Polygon:
        """Return the polygon of a named region of the world."""

    def object(self, name: str) -> Pose2 | None:
        """Return the current pose of an object or robot; None if it does not exist."""


class Stage(Situation, Protocol):
    """Interface through which actions change the world, one robot, and the goals and zones of its stack."""

    def of(self, robot: str) -> Stage:
        """Return the stage of the robot with this name."""

    def spawn(self, body: Body) -> None:
        """Add a body to the world from the next tick on. Replaces a body of the same name."""

    def add_pedestrian(self, walker: WalkingPedestrian) -> None:
        """Add a pedestrian that walks from the next tick on. Replaces a body of the same name."""

    def has_room(self, place: tuple[float, float], radius: float, walls_only: bool = False) -> bool:
        """Return whether a pedestrian of `radius` m fits at `place` (x, y in m) without touching an obstacle.

        If `walls_only`, only walls count as obstacles.
        """

    def rng(self, name: str) -> np.random.Generator:
        """Return a new generator of the random stream with this name."""

    def remove(self, name: str) -> None:
        """Remove an existing body from the world."""

    def door(self, name: str) -> tuple[Pose2, Pose2]:
        """Return the poses of a door panel when closed and when open."""

    def motion(self, name: str) -> tuple[MotionPath, float] | None:
        """Return the path of a moving object, and the time in s since the path started; None if it follows no path.

        For a pedestrian, the path has no motion: all of its poses are the current pose of the pedestrian.
        """

    def mass(self, name: str) -> float:
        """Return the mass in kg of an object; 0 if it cannot be pushed or does not exist."""

    def move(self, name: str, path: MotionPath) -> None:
        """Move an object along a path that starts now."""

    def place(self, name: str, pose: Pose2) -> None:
        """Move an object to `pose` at once, and end its motion along a path. The object is then at rest."""

    def place_robot(self, pose: Pose2) -> None:
        """Move the robot to `pose` at once, without informing the stack. The robot is then at rest."""

    def push(self, impulse: tuple[float, float], name: str | None = None, seconds: float = 0.0) -> None:
        """Apply an impulse (x, y) in N s at the center of an object with a mass, or of the robot if `name` is None.

        The impulse is spread evenly over `seconds`, or over one physics tick if `seconds` is 0.
        """

    def add_friction_patch(self, name: str, patch: FloorPatch) -> None:
        """Change the friction of a part of the floor; replaces a patch of the same name."""

    def send_goal(self, name: str) -> None:
        """Send the goal with this name to the stack. The new goal preempts the current goal."""

    def cancel_goal(self) -> None:
        """Cancel the current goal and all later goals, as an action client would."""

    def switch_zone(self, order: ZoneSwitch) -> str:
        """Send `order` to the costmap filters of the stack. Return the reason if it has no effect, otherwise ""."""

    def record_world_event(self, event: Event) -> None:
        """Record an event for all robots. A tick of 0 is replaced by the current tick."""

    def record_event(self, event: Event) -> None:
        """Record an event for this robot. A tick of 0 is replaced by the current tick."""
