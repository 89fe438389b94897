"""How velocity commands become motion, for each type of drive."""

from typing import Protocol

from simscen.core.motion import Twist


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

        On wheels: the mean angle in rad of the driven wheels on the left, and of those on the right. Omnidirectional:
        metres forward, metres to the left, and radians.
        """
        ...
