"""One robot under test, beat by beat: what it senses, the stack that drives it, what disturbs it, and who listens."""

from dataclasses import dataclass, field, replace

from simscen.core.records.events import Event
from simscen.core.records.trace import DeferredTruth, Moment, Truth
from simscen.record.backlog import Log
from simscen.run.ending import Ending
from simscen.run.faultrig import FaultRig
from simscen.run.live import LiveStage
from simscen.run.senses import Senses
from simscen.run.timetable import Timetable
from simscen.sim.robot import Robot
from simscen.stack.protocols import Stack


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
    logs: tuple[Log, ...] = ()
    due: bool = field(default=True, init=False)
    """Whether anything is due for it at this beat."""
    next: int = field(default=0, init=False)
    """The tick of its next beat."""
    _sample: Truth | DeferredTruth | None = field(default=None, init=False)
    moment: Moment = field(init=False)
    """What it made of its last beat."""

    def look(self, tick: int) -> None:
        """Where the robot is now, and what it has touched."""
        self.due = tick == self.next
        if self.due:
            self.next += self.timetable.until_next(tick)
        sampled = tick % self.truth_period == 0
        if self.stage.watched:
            self._sample = truth = self.robot.truth() if sampled else None
            self.stage.begin_beat(truth, self.due)
        else:
            self._sample = self.robot.sample(self.truth_period) if sampled else None
        for collision in self.robot.collisions():
            self.stage.note(collision)

    def decide(self, tick: int) -> None:
        """Read the sensors that are due, and hand them to the stack after the faults have had their way with them."""
        stage, faults = self.stage, self.faults
        if stage.orders:
            stage.pass_on(tick)
        readings = self.senses.read(tick)
        if faults.active:
            readings = faults.disturb(readings)
        decision = self.stack.decide(tick, readings)
        if stage.watched:
            stage.heard(decision, readings)
        if decision.events:
            self.ending.heard(decision)
        events = stage.take_events() if stage.fresh else ()
        self.moment = Moment(tick, self._sample, readings, decision, events)

    def record(self, end: Event | None) -> None:
        """Hand the moment to all who listen, with the end of the run where this is it."""
        moment = self.moment if end is None else replace(self.moment, events=(*self.moment.events, end))
        for log in self.logs:
            log.append(moment)

    def drive(self) -> None:
        """Let the wheels have the command, as far as the faults let them."""
        command = self.moment.decision.command
        self.robot.drive(self.faults.command(self.moment.tick, command) if self.faults.possible else command)
