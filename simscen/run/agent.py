"""One robot under test, beat by beat: what it senses, the stack that drives it, what disturbs it, and who listens."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from simscen.core.events import Event
from simscen.core.trace import Moment, Truth
from simscen.run.ending import Ending
from simscen.run.faultrig import FaultRig
from simscen.run.live import LiveStage
from simscen.run.senses import Senses
from simscen.run.timetable import Timetable
from simscen.sim.robot import Robot
from simscen.stack.protocols import Stack


class Log(Protocol):
    """Takes the moments of a robot, in order: the MCAP recorder, the trace builder, a progress display."""

    def append(self, moment: Moment) -> None:
        """Take one moment."""
        ...


@dataclass(eq=False)
class Agent:
    """A robot with all that is its own. At one beat: look, then decide, then record, then drive."""

    robot: Robot
    senses: Senses
    stack: Stack
    faults: FaultRig
    stage: LiveStage
    ending: Ending
    timetable: Timetable
    truth_period: int
    logs: Sequence[Log] = ()
    due: bool = field(default=True, init=False)
    """Whether anything is due for it at this beat."""
    next: int = field(default=0, init=False)
    """The tick of its next beat."""
    _truth: Truth | None = field(default=None, init=False)

    def look(self, tick: int) -> None:
        """Where the robot is now, and what it has touched."""
        self._truth = self.robot.truth() if tick % self.truth_period == 0 else None
        self.due = tick == self.next
        if self.due:
            self.next += self.timetable.until_next(tick)
        self.stage.begin_beat(self._truth, self.due)

    def decide(self, tick: int) -> Moment:
        """Read the sensors that are due, and hand them to the stack after the faults have had their way with them."""
        self.stage.pass_on(tick)
        readings = self.faults.disturb(self.senses.read(tick))
        decision = self.stack.decide(tick, readings)
        self.stage.heard(decision, readings)
        if decision.events:
            self.ending.heard(decision)
        return Moment(tick, self._truth, readings, decision, self.stage.take_events())

    def record(self, moment: Moment, end: Event | None) -> None:
        """Hand the moment to all who listen, with the end of the run where this is it."""
        if end is not None:
            moment = replace(moment, events=(*moment.events, end))
        for log in self.logs:
            log.append(moment)

    def drive(self, moment: Moment) -> None:
        """Let the wheels have the command, as far as the faults let them."""
        self.robot.drive(self.faults.command(moment.tick, moment.decision.command))
