"""Contract of recovery behaviors, such as spin: checks that every behavior must pass."""

from __future__ import annotations

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import Behavior, CostmapView, NavigationFailure
from simscen.testing.contracts.base import (
    ComponentContract,
    are_equal_costmaps,
    call_component,
    copy_costmap,
    costmap_of_world,
    promise,
    require,
)
from simscen.testing.contracts.controller import PERIOD_S, checked_command, move
from simscen.testing.flatland import Flatland

MAX_DURATION_S = 120.0
"""Maximum simulated duration of a behavior."""
START = Pose2(0.0, 0.0, 0.4)
"""Pose of the robot at the start of a behavior."""


class BehaviorContract(ComponentContract):
    """Contract of a behavior in wide and narrow square rooms."""

    role = "behavior"

    def view(self, half_width: float = 4.0) -> CostmapView:
        """Return the costmap of a square room around the origin with sides of 2 · `half_width` m."""
        inner, outer, edge = half_width, half_width + 0.2, half_width + 1.0
        walls = [(-outer, -outer, outer, -inner), (-outer, inner, outer, outer)]
        walls += [(-outer, -inner, -inner, inner), (inner, -inner, outer, inner)]
        return costmap_of_world(Flatland(walls), self.robot, (-edge, -edge, edge, edge))

    def simulate(self, behavior: Behavior, view: CostmapView) -> list[Pose2]:
        """Return the poses of a robot that follows the commands exactly until the behavior is done or fails."""
        track, seconds = [START], 0.0
        try:
            call_component("starts", lambda: behavior.start(START))
            while (command := self.command(behavior, track[-1], view, seconds)) is not None:
                track.append(move(track[-1], command))
                seconds += PERIOD_S
                require(seconds <= MAX_DURATION_S, f"has not ended after {MAX_DURATION_S:g} s")
        except NavigationFailure:
            pass
        return track

    def command(self, behavior: Behavior, pose: Pose2, view: CostmapView, seconds: float) -> Twist | None:
        """Return the next command, checked by `checked_command`; None if the behavior is done.

        `seconds` is the time since the start of the behavior.
        """
        command = call_component("computes a command", lambda: behavior.step(pose, view, seconds))
        return None if command is None else checked_command(command, self.robot)

    @promise
    def it_ends(self) -> None:
        """Given free space then the behavior is done or fails within two simulated minutes, also if started again."""
        behavior, view = self.build(), self.view()
        for _ in range(2):
            self.simulate(behavior, view)

    @promise
    def it_has_a_name(self) -> None:
        """Given any situation then the behavior has a name for events and criteria."""
        name = call_component("returns its name", lambda: self.build().name)
        require(isinstance(name, str) and name, f"is called {name!r}")

    @promise
    def it_never_drives_into_anything(self) -> None:
        """Given a narrow room then the robot touches no wall, or the behavior fails with a NavigationFailure."""
        footprint = Footprint(self.robot, 0.05)
        for gap in (0.08, 0.15, 0.3, 0.6):
            view = self.view(self.robot.circumscribed_radius + gap)
            for pose in self.simulate(self.build(), view):
                is_free = bool(footprint.free(view, np.array([pose]))[0])
                require(
                    is_free, f"drives into a wall with {gap:g} m of space: ({pose.x:.2f}, {pose.y:.2f}, {pose.yaw:.2f})"
                )

    @promise
    def the_same_calls_give_the_same_commands_bit_for_bit(self) -> None:
        """Given the same calls and seed then the commands are bit-identical."""
        one, other = (self.simulate(self.build(), self.view(0.6)) for _ in range(2))
        require(one == other, "two runs with the same seed differ")

    @promise
    def a_costmap_is_not_changed(self) -> None:
        """Given a costmap then the behavior does not change the costmap."""
        view = self.view(0.6)
        untouched = copy_costmap(view)
        self.simulate(self.build(), view)
        require(are_equal_costmaps(view, untouched), "changes the costmap")
