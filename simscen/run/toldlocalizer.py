"""What stands between the localizer and the navigator, so that a fault can tell the navigator something else."""

from collections.abc import Callable

from simscen.core.messages.localization import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.stack.protocols import Localizer


class ToldLocalizer:
    """A localizer whose belief reaches the others as `told` makes it; it goes on believing what it believes."""

    def __init__(self, inner: Localizer, told: Callable[[Belief], Belief]) -> None:
        self._inner, self._told = inner, told

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate."""
        self._inner.reset(estimate)

    def on_odometry(self, odometry: Odometry) -> None:
        """Take a step of dead reckoning."""
        self._inner.on_odometry(odometry)

    def on_scan(self, scan: Scan) -> None:
        """Correct with a lidar scan."""
        self._inner.on_scan(scan)

    def on_imu(self, imu: Imu) -> None:
        """Take a turn rate."""
        self._inner.on_imu(imu)

    @property
    def belief(self) -> Belief:
        """What the navigator hears."""
        return self._told(self._inner.belief)
