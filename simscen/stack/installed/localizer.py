"""A localizer behind its door."""

import numpy as np

from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.localizers import LocalizerSpec
from simscen.stack.installed.guarded_calls import Watched, all_finite
from simscen.stack.protocols import Localizer
from simscen.stack.setting import Setting


class InstalledLocalizer(Watched):
    """Hands readings on, and looks at each new belief before anybody trusts it."""

    may_fail = False

    def __init__(self, spec: LocalizerSpec, setting: Setting) -> None:
        super().__init__("localizer", spec, setting, Localizer)
        self._seen: Belief | None = None

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate."""
        self.ask(self.inner.reset, estimate)

    def on_odometry(self, odometry: Odometry) -> None:
        """Take a step of dead reckoning."""
        self.ask(self.inner.on_odometry, odometry)

    def on_scan(self, scan: Scan) -> None:
        """Correct with a lidar scan."""
        self.ask(self.inner.on_scan, scan)

    def on_imu(self, imu: Imu) -> None:
        """Take a turn rate."""
        self.ask(self.inner.on_imu, imu)

    @property
    def belief(self) -> Belief:
        """The localizer's belief. Raises RunError when it is none."""
        try:
            belief = self.inner.belief
        except Exception as error:  # as in `ask`, and it is asked at every beat
            self.raised(error)
        if self._seen is None or belief is not self._seen:
            self._seen = checked_belief(self, belief, self._seen)
        return self._seen


def checked_belief(watched: Watched, belief: object, before: Belief | None = None) -> Belief:
    """A belief of finite numbers in the right shapes; what it has of the one `before` is not looked at again."""
    if not isinstance(belief, Belief):
        watched.broke(f"believes {type(belief).__name__} instead of a Belief")
    watched.checked_pose(belief.pose, "believes to be at")
    if before is None or belief.map_from_odom is not before.map_from_odom:
        watched.checked_pose(belief.map_from_odom, "puts the odom frame at")
    if not _is_table(belief.covariance, 3) or len(belief.covariance) != 3:
        watched.broke("believes with a covariance that is no finite array (3, 3)")
    known = before is not None and belief.particles is before.particles and not belief.particles.flags.writeable
    if not known and not _is_table(belief.particles, 4):
        watched.broke("believes with particles that are no finite array (n, 4)")
    return belief


def _is_table(value: object, columns: int) -> bool:
    return isinstance(value, np.ndarray) and value.shape[1:] == (columns,) and all_finite(value)
