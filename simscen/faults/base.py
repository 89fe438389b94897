"""What a fault is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from simscen.core.readings import COMMAND, READINGS

if TYPE_CHECKING:
    from simscen.core.motion import Twist
    from simscen.core.sensing import Reading


@dataclass(frozen=True)
class Wheels:
    """What a fault may know of the drive: distance between left and right wheels in metres (0 = has none)."""

    separation: float = 0.0


class Disturbance:
    """A fault at work, from its start to its end. The default changes nothing.

    *Given* the same readings and generator *then* the same answers. It never changes a reading it was handed; it
    answers with another one.
    """

    def reading(self, reading: Reading) -> Reading | None:
        """What the stack gets instead of `reading`; None = it never arrives."""
        return reading

    def command(self, command: Twist) -> Twist:
        """What the wheels do instead of `command`."""
        return command

    def end(self) -> Disturbance | None:
        """What stays when the fault is over; None = nothing."""
        return None


class Fault(ABC):
    """A fault as specified in a scenario; `affects` are the kinds of instance it makes sense on.

    Kinds are the class names of core.sensing readings ("Scan", "Odometry", …) and "Command" for cmd_vel.
    """

    affects: ClassVar[frozenset[str]]

    @classmethod
    def broken_promise(cls) -> str:
        """Why it is no specification of a fault; "" for one that is."""
        affects: object = getattr(cls, "affects", None)
        known = {*READINGS, COMMAND}
        fine = isinstance(affects, frozenset) and affects and affects <= known
        return "" if fine else f"its `affects` is no set of {', '.join([*READINGS, COMMAND])}"

    @abstractmethod
    def begin(self, chance: np.random.Generator, wheels: Wheels) -> Disturbance:
        """Start it. `chance` is the fault's own stream."""
