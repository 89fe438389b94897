"""Where scripts will have things, worked out for some seconds at once."""

from collections.abc import Mapping, Sequence

import numpy as np

from simscen.core.geometry import Pose3
from simscen.core.geometry.scripted_poses import BatchPathSampler, PosesAtTick, PredictedPoses
from simscen.sim.objects.actor import Actor

LOOKAHEAD_S = 4
"""Seconds that are worked out at once."""


class ScheduledPoses:
    """Of things that follow paths; make another one when one of them is given another path."""

    def __init__(self, travelling: Sequence[Actor], tick_rate: int) -> None:
        self._travelling, self._rate = travelling, tick_rate
        self._foreseen: PredictedPoses | None = None
        self._tracks: BatchPathSampler | None = None

    def at(self, tick: int) -> PosesAtTick | None:
        """Where everything is at a tick; None where that was not worked out."""
        return None if self._foreseen is None else self._foreseen.at(tick)

    def forget(self) -> None:
        """Something else has moved than scripts say."""
        self._foreseen = None

    def look(self, tick: int, period: int, everything: Mapping[str, Pose3]) -> None:
        """Work it out from `tick` on for every `period` ticks, unless it is; of `everything` there is, others stay."""
        if (self._foreseen is not None and tick in self._foreseen.ticks) or any(a.led for a in self._travelling):
            return
        if self._tracks is None:
            paths = [(actor.path, actor.body.pose.z) for actor in self._travelling]
            self._tracks = BatchPathSampler([(path, z) for path, z in paths if path is not None])
        ticks = range(tick, tick + max(1, LOOKAHEAD_S * self._rate // period) * period, period)
        since = np.array([actor.since for actor in self._travelling])
        table = self._tracks.at((np.array(ticks)[:, np.newaxis] - since) / self._rate)
        names = tuple(actor.body.name for actor in self._travelling)
        self._foreseen = PredictedPoses(ticks, names, table, {**everything})
