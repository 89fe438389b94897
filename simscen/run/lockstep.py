"""The heart of simscen: one pass of the loop is one beat of the lockstep.

Everything happens at whole physics ticks, in this order, and nothing here knows what time it is outside. Between two
beats nothing is due but physics, so the simulation steps over those ticks in one go. Each robot has beats of its own,
at which its stack is handed what its sensors say, after the faults have had their way with it, and answers with one
command; it sees nothing else. All robots decide on what is, before any of them moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from simscen.core.records.events import Event
from simscen.run.agent import Agent
from simscen.run.director import Director
from simscen.run.ending import end_of
from simscen.sim.simulation import Simulation


@dataclass(frozen=True)
class Rig:
    """Everything a run is made of."""

    simulation: Simulation
    agents: Sequence[Agent]
    directors: Sequence[Director]
    truth_period: int


def run_lockstep(rig: Rig) -> Event:
    """Run to the end; each robot's moments go to its logs. Returns the event that ended the run."""
    simulation, agents, directors = rig.simulation, rig.agents, rig.directors
    while True:
        tick = simulation.tick
        for agent in agents:
            agent.look(tick)
        for director in directors:
            director.direct()

        over = tick % rig.truth_period == 0
        for agent in agents:
            if agent.due:
                agent.decide(tick)
            if tick < agent.ending.at:
                over = False
        end = end_of(tick, [agent.ending for agent in agents]) if over else None
        for agent in agents:
            if agent.due:
                agent.record(end)
        if end is not None:
            return end

        for agent in agents:
            if agent.due:
                agent.drive()
        simulation.step(min([agent.next for agent in agents]) - tick)
