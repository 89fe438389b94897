"""The run as a step of a story sees it: what counts, counts from when the step before it happened."""

from typing import Any

from simscen.core.records.events import Event
from simscen.core.stage import Situation


class Since:
    """A core.stage.Situation that begins now: time, way and events count from here, all else is as it is."""

    def __init__(self, now: Situation, others: "dict[str, Since] | None" = None) -> None:
        self._now, self._others = now, {} if others is None else others
        if others is None:
            self._others |= {name: Since(now.of(name), self._others) for name in now.robots}
        self._start, self._way, self._past = now.tick, now.travelled, len(now.events)

    def of(self, robot: str) -> "Since":
        """The same for another robot."""
        return self._others[robot]

    @property
    def tick(self) -> int:
        """Ticks since then."""
        return self._now.tick - self._start

    @property
    def travelled(self) -> float:
        """Metres driven since then."""
        return self._now.travelled - self._way

    @property
    def events(self) -> tuple[Event, ...]:
        """What has happened since then."""
        return self._now.events[self._past :]

    def scanned(self, sensor: str | None) -> int | None:
        """When the stack last received a scan, on the same clock; before the first, the start of the run."""
        last = self._now.scanned(sensor)
        return (0 if last is None else last) - self._start

    def __getattr__(self, name: str) -> Any:
        return getattr(self._now, name)
