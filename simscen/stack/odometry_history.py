"""Where odometry was a moment ago: a scan that comes late was taken from there."""

from bisect import bisect_right

from simscen.core.geometry import Pose2

KEPT = 128
"""Readings: three seconds at 40 Hz. What comes later than that is not worth placing."""


class OdometryHistory:
    """The newest odometry poses by tick."""

    def __init__(self) -> None:
        self._ticks: list[int] = []
        self._poses: list[Pose2] = []

    def __bool__(self) -> bool:
        return bool(self._poses)

    @property
    def now(self) -> Pose2:
        """The newest pose; the origin before there is any."""
        return self._poses[-1] if self._poses else Pose2(0.0, 0.0)

    def add(self, tick: int, pose: Pose2) -> None:
        """A new reading; one that is older than the newest is passed over."""
        if self._ticks and tick < self._ticks[-1]:
            return
        self._ticks.append(tick)
        self._poses.append(pose)
        if len(self._ticks) > 2 * KEPT:
            del self._ticks[:-KEPT], self._poses[:-KEPT]

    def at(self, tick: int) -> Pose2:
        """The pose at a tick (sample and hold); the oldest known before that."""
        place = bisect_right(self._ticks, tick)
        return self._poses[max(0, place - 1)] if self._poses else Pose2(0.0, 0.0)

    def then(self, now: Pose2, tick: int) -> Pose2:
        """Where a robot that is at `now` was at `tick`, in whatever frame `now` is given."""
        return now.compose(self.now.between(self.at(tick)))
