"""All sensors of the robot, each at its own rate."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence

from simscen.core.messages.sensor_data import Reading, Readings
from simscen.sensors.sensor import Sensor


class SensorSuite:
    """Reads the sensors that are due at a tick, in the order of the robot's specification.

    A reading shows the moment it carries the tick of; of a sensor that is late it comes so many ticks after that.
    """

    def __init__(self, sensors: Sequence[Sensor], latencies: Mapping[str, int] | None = None) -> None:
        """`latencies`: ticks from a reading to the stack, by the sensor's name."""
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
        """For each sensor that is late its period, and how much later its readings come, in ticks."""
        pairs = zip(self.periods, self._latencies, strict=True)
        return tuple((period, latency) for period, latency in pairs if latency)

    def read(self, tick: int) -> Readings:
        """The readings that come at this tick."""
        if self._punctual is not None:
            return tuple([sensor.read(tick) for sensor, period in self._punctual if tick % period == 0])
        come: list[Reading] = []
        for sensor, period, latency, late in self._each:
            if tick % period == 0:
                (late if latency else come).append(sensor.read(tick))
            while late and late[0].tick + latency <= tick:
                come.append(late.popleft())
        return tuple(come)


# MERGED: At which ticks anything is due.
class TickSchedule:
    """The ticks that are a multiple of at least one period, or so much later than one, in order.

    Nothing is tabulated: the pattern repeats only after the least common multiple of the periods, which may be long.
    """

    def __init__(self, periods: Iterable[int], later: Iterable[tuple[int, int]] = ()) -> None:
        """`later`: periods, and ticks after each multiple."""
        beats = {(period, 0) for period in periods} | {(period, ticks % period) for period, ticks in later}
        first, *rest = sorted(beat for beat in beats if not any(_among(beat, other) for other in beats))
        (self._period, self._late), self._rest = first, rest

    def due(self, tick: int) -> bool:
        """Whether anything is due at `tick`."""
        return self.until_next(tick - 1) == 1

    def until_next(self, tick: int) -> int:
        """How many ticks lie between `tick` and the next one at which something is due; at least 1."""
        until = self._period - (tick - self._late) % self._period
        if self._rest:  # of most robots a single one is left
            return min(until, *[period - (tick - ticks) % period for period, ticks in self._rest])
        return until


def _among(beat: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether all ticks of a beat are among those of another."""
    (period, ticks), (finer, its) = beat, other
    return beat != other and period % finer == 0 and ticks % finer == its
