"""Scheduled events and faults, their outcomes, and the kinds of messages that faults can affect."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Disturbance:
    """An event or a fault as the scenario orders it.

    `when` is its trigger as written, "" for a fault from the start. `required` says that the run fails unless it
    happens. `line` is where the entry stands in the scenario's own file; 0 = unknown. `after` is the number, among the
    events, of the one after which it is waited for: it is a step of a story.
    """

    name: str
    kind: Literal["event", "fault"]
    when: str = ""
    required: bool = True
    line: int = 0
    after: int | None = None

    @property
    def trigger(self) -> str:
        """The trigger in words: "when time: 10 s"."""
        if self.after is not None:
            return f"then when {self.when}" if self.when else "then at once"
        return f"when {self.when}" if self.when else "from the start"


@dataclass(frozen=True)
class DisturbanceOutcome:
    """What became of a disturbance: the ticks at which it `fired`, and whether it changed anything at any of them.

    `effect` tells in a line what it changed, or why nothing; `tick` is the first at which it did, or tried to.
    """

    ordered: Disturbance
    fired: tuple[int, ...]
    happened: bool
    effect: str
    tick: int | None = None

    @property
    def missing(self) -> bool:
        """Whether it had to happen and did not."""
        return self.ordered.required and not self.happened


READING_KINDS = ("Scan", "Odometry", "Imu", "Bump", "Image")
"""The classes of core.sensing."""
COMMAND = "Command"
"""The kind of cmd_vel: velocity commands on their way to the base."""
WHEELS = "Wheels"
"""The kind of wheels: what the motors make of a command, and what odometry counts of it."""
BELIEF = "Belief"
"""The kind of the localizer: where the navigator is told that the robot is."""
MAP = "Map"
"""The kind of the map that the stack is given."""
KIND_BY_INSTANCE = {"cmd_vel": COMMAND, "wheels": WHEELS, "localizer": BELIEF, "map": MAP}
"""What faults affect besides sensors, by the name that scenarios have for it; a sensor of that name goes before."""
FAULT_TARGET_KINDS = (*READING_KINDS, *KIND_BY_INSTANCE.values())
"""All that `affects` of a fault may name."""
