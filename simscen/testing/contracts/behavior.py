"""The promises of a recovery behavior."""

from __future__ import annotations

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import Behavior, CostmapView, NavigationFailure
from simscen.testing.contracts.base import (
    ComponentContract,
    call_component,
    copy_costmap,
    equal_costmaps,
    promise,
    require,
    view_of,
)
from simscen.testing.contracts.controller import PERIOD, SLACK, moved
from simscen.testing.flatland import Flatland

LONGEST = 120.0
"""Simulated seconds after which a behavior must have ended."""
MIDDLE = Pose2(0.0, 0.0, 0.4)


class BehaviorContract(ComponentContract):
    """Tried in the open, and in closets with as little room as 2 cm on each side."""

    role = "behavior"

    def view(self, half: float = 4.0) -> CostmapView:
        """The costmap of a square room around the robot, `half` as wide, in meters."""
        walls = [(-half - 0.2, -half - 0.2, half + 0.2, -half), (-half - 0.2, half, half + 0.2, half + 0.2)]
        walls += [(-half - 0.2, -half, -half, half), (half, -half, half + 0.2, half)]
        edge = half + 1.0
        return view_of(Flatland(walls), self.robot, (-edge, -edge, edge, edge))

    def done(self, behavior: Behavior, view: CostmapView) -> list[Pose2]:
        """The track of a base that does what it says until it is done or fails."""
        track, seconds = [MIDDLE], 0.0
        try:
            call_component("starts", lambda: behavior.start(MIDDLE))
            while (command := self.command(behavior, track[-1], view, seconds)) is not None:
                track.append(moved(track[-1], command))
                seconds += PERIOD
                require(seconds <= LONGEST, f"has not ended after {LONGEST:g} s")
        except NavigationFailure:
            pass
        return track

    def command(self, behavior: Behavior, pose: Pose2, view: CostmapView, seconds: float) -> Twist | None:
        """Its command, looked at for type, finiteness and limits; None when it is done."""
        command = call_component("is asked for a command", lambda: behavior.step(pose, view, seconds))
        if command is None:
            return None
        require(isinstance(command, Twist), f"commands {type(command).__name__}, not a Twist")
        require(all(map(math.isfinite, command)), f"commands {tuple(command)}")
        robot = self.robot
        within = -robot.max_reverse - SLACK <= command.vx <= robot.max_linear + SLACK
        within = (
            within and abs(command.vy) <= robot.max_lateral + SLACK and abs(command.wz) <= robot.max_angular + SLACK
        )
        require(within, f"commands {tuple(command)}, more than the base can do")
        return command

    @promise
    def it_ends(self) -> None:
        """Given room then it is done or fails within two simulated minutes, and so it does when it is started again."""
        behavior, view = self.built(), self.view()
        for _ in range(2):
            self.done(behavior, view)

    @promise
    def it_has_a_name(self) -> None:
        """Given a behavior then its name says what it is in events and criteria."""
        name = call_component("is asked for its name", lambda: self.built().name)
        require(isinstance(name, str) and name, f"is called {name!r}")

    @promise
    def it_never_drives_into_anything(self) -> None:
        """Given a closet then it moves only where the hull is free, or fails with a NavigationFailure."""
        footprint = Footprint(self.robot, 0.05)
        for room in (0.08, 0.15, 0.3, 0.6):
            view = self.view(self.robot.circumscribed_radius + room)
            for pose in self.done(self.built(), view):
                free = bool(footprint.free(view, np.array([pose]))[0])
                require(
                    free, f"drives into a wall with {room:g} m of room: ({pose.x:.2f}, {pose.y:.2f}, {pose.yaw:.2f})"
                )

    @promise
    def the_same_calls_give_the_same_commands_bit_for_bit(self) -> None:
        """Given the same calls with the same generator then bit-identical commands: no clock, no global chance."""
        one, other = (self.done(self.built(), self.view(0.6)) for _ in range(2))
        require(one == other, "two tries with the same generator differ")

    @promise
    def a_costmap_is_not_changed(self) -> None:
        """Given a costmap then it is not changed."""
        view = self.view(0.6)
        untouched = copy_costmap(view)
        self.done(self.built(), view)
        require(equal_costmaps(view, untouched), "the costmap is not what it was")
