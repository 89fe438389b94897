"""Samples of the truth that nobody has looked at yet: what comes of the engine's numbers can wait.

Who looks is the log, up to 0.9 s later: what works samples out has left the processor's caches after each beat, so that
several in a row take half the time.
"""

from simscen.core.trace import Truth
from simscen.sim.actors import Actors
from simscen.sim.clearance import Clearance
from simscen.sim.state import State

_made = tuple.__new__  # a truth without the calls of its class


class Sample:
    """How a robot was at a tick."""

    __slots__ = ("made", "samples", "state", "tick")

    def __init__(self, samples: "Samples", tick: int, state: State) -> None:
        self.samples, self.tick, self.state = samples, tick, state
        self.made: Truth | None = None

    def truth(self) -> Truth:
        """All of it; see core.trace.Late."""
        if self.made is None:
            self.samples.settle()
        assert self.made is not None
        return self.made


class Samples:
    """Those of one robot. Only while nothing moves but by a script, and far from the robot, do any wait."""

    def __init__(self, clearance: Clearance, actors: Actors) -> None:
        self._clearance, self._actors = clearance, actors
        self._waiting: list[Sample] = []

    def take(self, tick: int, state: State) -> Sample:
        """One that is worked out when somebody asks for it, or for another."""
        sample = Sample(self, tick, state)
        self._waiting.append(sample)
        return sample

    def settle(self) -> None:
        """Work out all that wait."""
        if not self._waiting:
            return
        waiting, self._waiting = self._waiting, []
        standing, placed = self._clearance.standing, self._actors.scripted([sample.tick for sample in waiting])
        for sample, objects in zip(waiting, placed, strict=True):
            state = sample.state
            sample.made = _made(Truth, (state.pose, state.twist, standing(state.pose), objects))
