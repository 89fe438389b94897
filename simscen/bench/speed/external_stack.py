"""What a stack behind the stack protocol costs for each beat: simscen's own, in the engine and as a process."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from simscen.bench.speed.measurement import Stopwatch
from simscen.bench.speed.run_speed import PATROL, SEED
from simscen.core.records.trace import Moment
from simscen.loading.scenario import load_scenario
from simscen.record.recorder import MomentSink
from simscen.run.external.build import with_external_reference
from simscen.run.lockstep import RunSetup
from simscen.run.preparation.scenario import PreparedScenario, prepare
from simscen.run.simulate import simulate


@dataclass(frozen=True)
class ExternalStackCost:
    """Of the same drive: its beats, and µs of wall time in which the engine waits for the stack at each.

    `here_us` with the stack in the engine, `there_us` with all it hears and says going over the socket, in full.
    """

    beats: int
    here_us: float
    there_us: float

    @property
    def ratio(self) -> float:
        """How many times longer a beat takes."""
        return self.there_us / self.here_us


def measure_external(rounds: int) -> ExternalStackCost:
    """The medians of several drives of the patrol, without a log."""
    prepared = prepare(load_scenario(PATROL, PATROL.parent))
    here = [_each_beat(prepared) for _ in range(rounds)]
    there = [_each_beat(with_external_reference(prepared)) for _ in range(rounds)]
    return ExternalStackCost(
        here[0][0], statistics.median(us for _, us in here), statistics.median(us for _, us in there)
    )


def _each_beat(prepared: PreparedScenario) -> tuple[int, float]:
    watch, beats = Stopwatch(), _Beats()

    def attach(setup: RunSetup, _: Sequence[MomentSink]) -> Sequence[MomentSink]:
        watch.watch("stack", setup.robots[0].stack, "decide")
        return (beats,)

    simulate(prepared, SEED, attach=attach)
    return beats.count, 1e6 * watch.seconds["stack"] / beats.count


class _Beats:
    """Counts them."""

    def __init__(self) -> None:
        self.count = 0

    def append(self, moment: Moment) -> None:
        """One more."""
        self.count += 1
