"""Samples of the truth that nobody has looked at yet: what comes of the engine's numbers can wait.

Who looks is the log, up to 0.9 s later: what works samples out has left the processor's caches after each beat, so that
several in a row take half the time.
"""

from collections.abc import Mapping

from simscen.core.geometry import Pose3
from simscen.core.records.trace import Truth
from simscen.sim.contact.clearance import Clearance
from simscen.sim.robots.robot_state import RobotState

_made = tuple.__new__  # a truth without the calls of its class


class DeferredTruth:
    """How a robot was at a tick, and where things were."""

    __slots__ = ("made", "objects", "samples", "state")

    def __init__(self, samples: "TruthSampler", state: RobotState, objects: Mapping[str, Pose3]) -> None:
        self.samples, self.state, self.objects = samples, state, objects
        self.made: Truth | None = None

    def truth(self) -> Truth:
        """All of it; see core.trace.Late."""
        if self.made is None:
            self.samples.settle()
        assert self.made is not None
        return self.made


class TruthSampler:
    """Those of one robot. Only while it is far from all that moves do any wait."""

    def __init__(self, clearance: Clearance) -> None:
        self._clearance = clearance
        self._waiting: list[DeferredTruth] = []

    def take(self, state: RobotState, objects: Mapping[str, Pose3]) -> DeferredTruth:
        """One that is worked out when somebody asks for it, or for another."""
        sample = DeferredTruth(self, state, objects)
        self._waiting.append(sample)
        return sample

    def settle(self) -> None:
        """Work out all that wait."""
        waiting, self._waiting = self._waiting, []
        standing = self._clearance.standing
        for sample in waiting:
            state = sample.state
            sample.made = _made(Truth, (state.pose, state.twist, standing(state.pose), sample.objects))
