"""Disturbances of a run: the events and faults that a scenario schedules, their outcomes, and the targets of faults."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Disturbance:
    """Event or fault that a scenario schedules.

    `when` is the trigger as text from the scenario; "" for a fault that is active from the start, and for a step of
    `then` that follows at once. If `required`, the run fails unless the disturbance takes place. `line` is the line in
    the scenario file; 0 if unknown. `after` is the index of the previous step in a sequence (`then`); None for the
    first step and for all other disturbances.
    """

    name: str
    kind: Literal["event", "fault"]
    when: str = ""
    required: bool = True
    line: int = 0
    after: int | None = None

    @property
    def trigger(self) -> str:
        """Trigger as text, e.g. "when time: 10 s" or "from the start"."""
        if self.after is not None:
            return f"then when {self.when}" if self.when else "then at once"
        return f"when {self.when}" if self.when else "from the start"


@dataclass(frozen=True)
class DisturbanceOutcome:
    """Outcome of a disturbance.

    `fired` contains the ticks at which the trigger fired. `happened` is True if the fault, or each action of the event,
    took effect at least once. `effect` describes the change, or the reason why it did not happen. `tick` is the tick of
    the first change, or of the first attempt if the disturbance did not happen; None without an attempt.
    """

    disturbance: Disturbance
    fired: tuple[int, ...]
    happened: bool
    effect: str
    tick: int | None = None

    @property
    def missing(self) -> bool:
        """Whether the disturbance is required but did not take place."""
        return self.disturbance.required and not self.happened


READING_KINDS = ("Scan", "Odometry", "Imu", "Bump", "Image")
"""Kinds of fault targets that are sensors: class names of the sensors' readings in core.messages.sensor_data."""
COMMAND = "Command"
"""Kind of the fault target `cmd_vel`: velocity commands from the stack to the base."""
WHEELS = "Wheels"
"""Kind of the fault target `wheels`: the motion that the motors execute, and the motion that odometry measures."""
BELIEF = "Belief"
"""Kind of the fault target `localizer`: the estimated pose that the navigator receives."""
MAP = "Map"
"""Kind of the fault target `map`: the map that the stack receives."""
KIND_BY_TARGET_NAME = {"cmd_vel": COMMAND, "wheels": WHEELS, "localizer": BELIEF, "map": MAP}
"""Kinds of fault targets by name in a scenario. A sensor of the same name takes precedence."""
FAULT_TARGET_KINDS = (*READING_KINDS, *KIND_BY_TARGET_NAME.values())
"""All kinds of fault targets. The attribute `affects` of a fault contains the kinds that the fault can affect."""
