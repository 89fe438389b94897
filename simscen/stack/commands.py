"""From what the controller wants to what is sent to the base."""

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.latency_queue import LatencyQueue
from simscen.stack.velocity_smoother import VelocitySmoother

CRAWL = 0.02
"""m/s and rad/s (times five): what is slower does not count as driving."""


class Commands:
    """The velocity smoother, then the collision monitor; what each makes is there as late as it is slow."""

    def __init__(
        self, smoother: VelocitySmoother, monitor: CollisionMonitor, period: int, latency: tuple[int, int]
    ) -> None:
        """`period` of the controller in ticks; `latency` of controller and monitor in ticks."""
        self._smoother, self._monitor, self._period = smoother, monitor, period
        self._wanted, self._allowed = LatencyQueue[tuple[Twist, int]](latency[0]), LatencyQueue[Twist](latency[1])
        self._at_once: tuple[Twist, int] | None = None
        self._asked, self._free_at = 0, 0
        self.latency = latency[0]
        """Ticks that the controller takes for a command."""
        self.late = any(latency)
        """Whether there may be something to do between two commands of the controller."""
        self.sent = STOP
        """What is sent to the base now."""

    def busy(self, tick: int) -> bool:
        """Whether the controller still works on its last command."""
        return self.late and self._wanted.busy(tick)

    def periods(self, tick: int) -> int:
        """How many of its periods the controller has taken since it was last asked, or since the robot was stopped."""
        return max(1, (tick - self._asked) // self._period)

    def want(self, tick: int, wanted: Twist, periods: int) -> None:
        """What the controller makes of what it was told at this tick, so many of its periods after the last time."""
        self._asked = tick
        if self.late:
            self._wanted.put(tick, (wanted, periods))
        else:
            self._at_once = wanted, periods

    def stop(self, tick: int) -> None:
        """Stop at once; what is under way counts no more."""
        self._wanted.clear()
        self._allowed.clear()
        self._at_once = None
        self._smoother.reset(STOP)
        self._asked = self._free_at = tick
        self.sent = STOP

    def step(self, tick: int, odometry: Pose2) -> None:
        """Time has come to this tick, and the robot to this pose in the odom frame."""
        if self._at_once is not None:
            self.sent = self._guarded(tick, *self._at_once, odometry)
            self._at_once = None
        while tick >= self._wanted.due:
            self._allowed.put(tick, self._guarded(tick, *self._wanted.take(), odometry))
        while tick >= self._allowed.due:
            self.sent = self._allowed.take()

    def held(self, tick: int) -> bool:
        """Whether the monitor has allowed nothing for its `hold_timeout`; once told, the waiting begins anew."""
        held = tick - self._free_at >= self._monitor.hold_ticks
        if held:
            self._free_at = tick
        return held

    def _guarded(self, tick: int, wanted: Twist, periods: int, odometry: Pose2) -> Twist:
        smooth = self._smoother.smooth(wanted, periods)
        allowed = self._monitor.allow(smooth, odometry)
        if allowed is not smooth:
            self._smoother.reset(allowed)
        crawls = abs(allowed.vx) + abs(allowed.vy) < CRAWL and abs(allowed.wz) < 5 * CRAWL
        if not crawls or wanted == STOP:
            self._free_at = tick
        return allowed
