"""Read the sensors of a robot at their rates, and compute the ticks at which anything is due."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence

from simscen.core.messages.sensor_data import Reading, Readings
from simscen.sensors.sensor import Sensor


class SensorSuite:
    """The sensors of a robot, in the order of its specification.

    A reading carries the tick at which it was measured. It reaches the stack after the latency of its sensor.
    """

    def __init__(self, sensors: Sequence[Sensor], latencies: Mapping[str, int] | None = None) -> None:
        """`latencies`: ticks from measurement to arrival at the stack, by sensor name."""
        self._sensors = tuple(sensors)
        latencies = latencies or {}
        self._latencies = [latencies.get(sensor.name, 0) for sensor in self._sensors]
        self._late: list[deque[Reading]] = [deque() for _ in self._sensors]
        self._each = list(zip(self._sensors, self.periods, self._latencies, self._late, strict=True))
        self._punctual = None if any(self._latencies) else list(zip(self._sensors, self.periods, strict=True))

    @property
    def periods(self) -> tuple[int, ...]:
        """The period of each sensor in ticks."""
        return tuple(sensor.period for sensor in self._sensors)

    @property
    def arrivals(self) -> tuple[tuple[int, int], ...]:
        """Period and latency in ticks of each sensor with a latency."""
        pairs = zip(self.periods, self._latencies, strict=True)
        return tuple((period, latency) for period, latency in pairs if latency)

    def read(self, tick: int) -> Readings:
        """Return the readings that arrive at this tick."""
        if self._punctual is not None:
            return tuple([sensor.read(tick) for sensor, period in self._punctual if tick % period == 0])
        come: list[Reading] = []
        for sensor, period, latency, late in self._each:
            if tick % period == 0:
                (late if latency else come).append(sensor.read(tick))
            while late and late[0].tick + latency <= tick:
                come.append(late.popleft())
        return tuple(come)


class TickSchedule:
    """Schedule of all ticks that are a multiple of a period, or a fixed number of ticks later.

    Computes each tick on demand, because the least common multiple of the periods can be large.
    """

    def __init__(self, periods: Iterable[int], later: Iterable[tuple[int, int]] = ()) -> None:
        """`later`: pairs of a period and the delay after each multiple of it, in ticks."""
        beats = {(period, 0) for period in periods} | {(period, ticks % period) for period, ticks in later}
        first, *rest = sorted(beat for beat in beats if not any(_among(beat, other) for other in beats))
        (self._period, self._late), self._rest = first, rest

    def due(self, tick: int) -> bool:
        """Return whether anything is due at a tick."""
        return self.until_next(tick - 1) == 1

    def until_next(self, tick: int) -> int:
        """Return the number of ticks from `tick` to the next due tick; at least 1."""
        until = self._period - (tick - self._late) % self._period
        if self._rest:  # most robots have a single period left
            return min(until, *[period - (tick - ticks) % period for period, ticks in self._rest])
        return until


def _among(beat: tuple[int, int], other: tuple[int, int]) -> bool:
    """Return whether another entry covers all ticks of this one."""
    (period, ticks), (finer, its) = beat, other
    return beat != other and period % finer == 0 and ticks % finer == its
