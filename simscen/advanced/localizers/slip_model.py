"""Detection of wheel slip by comparing turn rates, and the motion model of the EKF that estimates slip."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from simscen.advanced.spec import SlipEkf
from simscen.core.geometry import Array, Pose2

FAST_SLIP_GATE = 15.1
"""Ratio of a squared innovation to its variance above which the wheels slip: the chi-square quantile of 99.99 %."""
SLOW_SLIP_WINDOW_S, SLOW_SLIP_GATE = 0.5, 24.0
"""Slow slip starts when the squared sum of the innovations in the window, divided by its variance, is above the gate:
the chi-square quantile of 99.9999 %."""
SLIP_END_WINDOW_S, SLIP_END_GATE = 0.15, 4.0
"""Slow slip ends when the ratio of this window is below the gate: the chi-square quantile of 95 %."""


class SlipDetector:
    """Detects wheel slip by the innovation: the turn rate of the gyroscope minus the turn rate of the wheels."""

    def __init__(self) -> None:
        self._recent: deque[tuple[float, float, float]] = deque()
        """Innovation in rad, its variance in rad², and duration in s of each step in the window."""
        self._slips_slowly = self._slips = False

    def update(self, innovation: float, noise: float, bias_variance: float, seconds: float) -> float:
        """Return the duration in s of slip that earlier calls have not returned; 0 without slip.

        innovation:     in rad/s
        noise:          variance of this step's innovation, in (rad/s)²
        bias_variance:  variance of the gyroscope's bias, in (rad/s)², the same for all steps
        seconds:        duration of the step, which is the time since the last call
        """
        slow_slip_s = self._slow_slip(innovation * seconds, noise * seconds**2, bias_variance, seconds)
        slipped_before = self._slips
        self._slips_slowly = slow_slip_s > 0.0
        self._slips = self._slips_slowly or innovation**2 > FAST_SLIP_GATE * (noise + bias_variance)
        if not self._slips:
            return 0.0
        return seconds if slipped_before else max(seconds, slow_slip_s)

    def _slow_slip(self, innovation: float, noise: float, bias_variance: float, seconds: float) -> float:
        """Return the duration in s of the present window if the sum of its innovations exceeds the gate, else 0.

        `innovation` is in rad, `noise` in rad², and `bias_variance` in (rad/s)².
        """
        self._recent.append((innovation, noise, seconds))
        window, gate = (
            (SLIP_END_WINDOW_S, SLIP_END_GATE) if self._slips_slowly else (SLOW_SLIP_WINDOW_S, SLOW_SLIP_GATE)
        )
        while len(self._recent) > 1 and sum(step[2] for step in self._recent) > window + 1e-9:
            self._recent.popleft()
        total, variance, duration = map(sum, zip(*self._recent, strict=True))
        return duration if total**2 > gate * (variance + bias_variance * duration**2) else 0.0


X, Y, YAW, RATE, BIAS, SLIP_X, SLIP_Y = range(7)
"""Indices of the state (7,) of the EKF: pose in the map, turn rate, gyroscope bias, longitudinal and lateral slip.

Slip is the speed that the wheels do not measure, relative to the possible speed of the robot (`WheelStep.speed`).
"""
SLIP_TIME_S = 1.0
"""Correlation time of slip."""
UNKNOWN_RATE_STD_RAD_S = 10.0
"""Standard deviation of the turn rate while the wheels slip, before the gyroscope measures it."""
SLIP_LEVER_M = 0.1
"""Distance from the base to the point around which a slipping robot rotates."""
SLIP_STD = 0.7
"""Standard deviation of slip in each direction while the wheels slip; 0.58 would be a uniform distribution up to 1."""
PUSHED_SPEED_M_S = 0.3
"""Minimum possible speed if the robot turns faster than its wheels measure, because a slope or a person moves it."""


@dataclass(frozen=True)
class WheelStep:
    """Motion between two odometry readings, as measured by the wheels.

    motion:           motion of the base, in the base frame at the start of the step
    seconds:          duration
    speed:            possible speed: the highest plausible speed of the robot in m/s
    slips:            whether the wheels slip
    undetected_slip:  duration in s of slip that earlier steps do not include, from SlipDetector.update
    """

    motion: Pose2
    seconds: float
    speed: float
    slips: bool = False
    undetected_slip: float = 0.0

    @property
    def length(self) -> float:
        """Distance driven in m."""
        return math.hypot(self.motion.x, self.motion.y)


def rate_model(spec: SlipEkf, step: WheelStep, noise: float, slipped_before: bool) -> tuple[Array, Array]:
    """Return the Jacobian (7, 7) and the process noise (7, 7) of turn rate, bias and slip for a step.

    `noise` is the variance of the turn rate of the wheels in (rad/s)². `slipped_before` states whether the wheels
    slipped in the previous step.
    """
    f, q = np.eye(7), np.zeros((7, 7))
    f[RATE, RATE], q[RATE, RATE] = 0.0, UNKNOWN_RATE_STD_RAD_S**2 if step.slips else noise
    q[BIAS, BIAS] = spec.gyro_bias_walk**2 * step.seconds
    if step.slips != slipped_before:
        f[SLIP_X, SLIP_X] = f[SLIP_Y, SLIP_Y] = 0.0
        q[SLIP_X, SLIP_X], q[SLIP_Y, SLIP_Y] = (SLIP_STD**2, SLIP_STD**2) if step.slips else (spec.wheel_slip**2, 0.0)
    elif not step.slips:
        f[SLIP_X, SLIP_X] = math.exp(-step.seconds / SLIP_TIME_S)
        q[SLIP_X, SLIP_X] = spec.wheel_slip**2 * (1.0 - f[SLIP_X, SLIP_X] ** 2)
    return f, q


def predict_state(state: Array, step: WheelStep) -> Array:
    """Return the state (7,) after a step, in which only the pose changes."""
    after: Array = state.copy()
    after[[X, Y]] += _translation(state, step)
    after[YAW] = math.remainder(state[YAW] + state[RATE] * step.seconds, 2 * math.pi)
    return after


def pose_model(spec: SlipEkf, state: Array, step: WheelStep) -> tuple[Array, Array]:
    """Return the Jacobian (7, 7) of `predict_state` for a step from `state` (7,), and the process noise (7, 7).

    The slip columns of the Jacobian are for a step of `undetected_slip` seconds, so that the uncertainty includes
    earlier slip.
    """
    dx, dy = _translation(state, step)
    c, s = _direction(state, step)
    f, q = np.eye(7), np.zeros((7, 7))
    f[:2, YAW] = -dy, dx
    f[:3, RATE] = -dy * step.seconds / 2, dx * step.seconds / 2, step.seconds
    slid = step.speed * (step.undetected_slip or step.seconds)
    f[:2, SLIP_X], f[:2, SLIP_Y] = (c * slid, s * slid), (-s * slid, c * slid)
    if step.length > 0:
        wheels = c * step.motion.x - s * step.motion.y, s * step.motion.x + c * step.motion.y
        q[:2, :2] = spec.translation_noise**2 / step.length * np.outer(wheels, wheels)
    return f, q


def _direction(state: Array, step: WheelStep) -> tuple[float, float]:
    """Return the cosine and sine of the heading in the map frame along which a step is added."""
    along = float(state[YAW] + (state[RATE] * step.seconds - step.motion.yaw) / 2)
    return math.cos(along), math.sin(along)


def _translation(state: Array, step: WheelStep) -> tuple[float, float]:
    """Return the translation of a step along x and y of the map in m."""
    c, s = _direction(state, step)
    slid = step.speed * step.seconds
    x, y = step.motion.x + float(state[SLIP_X]) * slid, step.motion.y + float(state[SLIP_Y]) * slid
    return c * x - s * y, s * x + c * y
