"""Contract of recovery behaviors."""

from __future__ import annotations

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
from simscen.testing.contracts.controller import PERIOD, checked_command, moved
from simscen.testing.flatland import Flatland

LONGEST = 120.0
"""Maximum simulated duration of a behavior in s."""
MIDDLE = Pose2(0.0, 0.0, 0.4)


class BehaviorContract(ComponentContract):
    """Contract of a behavior, in open space and in narrow rooms."""

    role = "behavior"

    def view(self, half: float = 4.0) -> CostmapView:
        """Return the costmap of a square room around the robot; `half` is half of its width in m."""
        walls = [(-half - 0.2, -half - 0.2, half + 0.2, -half), (-half - 0.2, half, half + 0.2, half + 0.2)]
        walls += [(-half - 0.2, -half, -half, half), (half, -half, half + 0.2, half)]
        edge = half + 1.0
        return view_of(Flatland(walls), self.robot, (-edge, -edge, edge, edge))

    def done(self, behavior: Behavior, view: CostmapView) -> list[Pose2]:
        """Return the track of a base that follows the commands until the behavior is done or fails."""
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
        """Return the checked command, or None if the behavior is done."""
        command = call_component("is asked for a command", lambda: behavior.step(pose, view, seconds))
        return None if command is None else checked_command(command, self.robot)

    @promise
    def it_ends(self) -> None:
        """Given free space then it is done or fails within two simulated minutes, also when it is started again."""
        behavior, view = self.build(), self.view()
        for _ in range(2):
            self.done(behavior, view)

    @promise
    def it_has_a_name(self) -> None:
        """Given a behavior then it has a name for events and criteria."""
        name = call_component("is asked for its name", lambda: self.build().name)
        require(isinstance(name, str) and name, f"is called {name!r}")

    @promise
    def it_never_drives_into_anything(self) -> None:
        """Given a narrow room then the robot touches no wall, or the behavior fails with a NavigationFailure."""
        footprint = Footprint(self.robot, 0.05)
        for room in (0.08, 0.15, 0.3, 0.6):
            view = self.view(self.robot.circumscribed_radius + room)
            for pose in self.done(self.build(), view):
                free = bool(footprint.free(view, np.array([pose]))[0])
                require(
                    free, f"drives into a wall with {room:g} m of room: ({pose.x:.2f}, {pose.y:.2f}, {pose.yaw:.2f})"
                )

    @promise
    def the_same_calls_give_the_same_commands_bit_for_bit(self) -> None:
        """Given the same calls with the same generator then bit-identical commands."""
        one, other = (self.done(self.build(), self.view(0.6)) for _ in range(2))
        require(one == other, "two tries with the same generator differ")

    @promise
    def a_costmap_is_not_changed(self) -> None:
        """Given a costmap then it is not changed."""
        view = self.view(0.6)
        untouched = copy_costmap(view)
        self.done(self.build(), view)
        require(equal_costmaps(view, untouched), "the costmap is not what it was")
