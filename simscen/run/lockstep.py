"""The heart of simscen: one pass of the loop is one beat of the lockstep.

Everything happens at whole physics ticks, in this order, and nothing here knows what time it is outside. Between two
beats nothing is due but physics, so the simulation steps over those ticks in one go. The stack is handed what its
sensors say, after the faults have had their way with it, and answers with one command; it sees nothing else.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from simscen.core.events import Event
from simscen.core.trace import Moment
from simscen.run.director import Director
from simscen.run.ending import Ending
from simscen.run.faultrig import FaultRig
from simscen.run.live import LiveStage
from simscen.run.senses import Senses
from simscen.run.timetable import Timetable
from simscen.sim.simulation import Simulation
from simscen.stack.protocols import Stack


class Log(Protocol):
    """Takes the moments of a run, in order: the MCAP recorder, the trace builder, a progress display."""

    def append(self, moment: Moment) -> None:
        """Take one moment."""
        ...


@dataclass(frozen=True)
class Rig:
    """Everything a run is made of."""

    simulation: Simulation
    senses: Senses
    stack: Stack
    faults: FaultRig
    stage: LiveStage
    director: Director
    ending: Ending
    timetable: Timetable
    truth_period: int


def run_lockstep(rig: Rig, logs: Sequence[Log]) -> Event:
    """Run to the end; every moment goes to `logs`. Returns the event that ended the run."""
    simulation = rig.simulation
    while True:
        tick = simulation.tick
        truth = simulation.truth() if tick % rig.truth_period == 0 else None
        rig.stage.begin_beat(truth)
        rig.director.direct()

        readings = rig.faults.disturb(rig.senses.read(tick))
        decision = rig.stack.decide(tick, readings)
        rig.stage.heard(decision, readings)
        rig.ending.heard(decision)

        moment = Moment(tick, truth, readings, decision, rig.stage.take_events())
        end = rig.ending.reached(tick) if truth is not None else None
        if end is not None:
            moment = replace(moment, events=(*moment.events, end))
        for log in logs:
            log.append(moment)
        if end is not None:
            return end

        simulation.drive(rig.faults.command(decision.command))
        simulation.step(rig.timetable.until_next(tick))
