"""How a robot moves that wheels and a gyroscope watch: the model of the EKF, and nothing of its algebra."""

import math
from dataclasses import dataclass

import numpy as np

from simscen.advanced.localizers.spec import SlipEkf
from simscen.core.geometry import Array, Pose2

X, Y, YAW, RATE, BIAS, AHEAD, ASIDE = range(7)
"""The state: pose in the map, turn rate, the gyroscope's bias, and slip: the speed ahead and aside that no wheel sees,
as a share of how fast the robot may be."""
SLIP_LASTS = 1.0
"""Seconds after which a slip has mostly become another one."""
UNKNOWN_RATE = 10.0
"""rad/s: where the wheels slip, nothing is known of the turn rate before the gyroscope measures it."""
LEVER = 0.1
"""Meters from the middle of a robot to what it turns about when its wheels slip."""
SHARE = 0.7
"""Standard deviation of that share, ahead and aside: uniform up to all of it is 0.58, always all of it 1."""
PUSHED = 0.3
"""m/s: a robot that turns more than its wheels do is moved by something else: a slope, a person, its own momentum."""


@dataclass(frozen=True)
class Step:
    """What the wheels say of a step: its pose in the base frame, and how long it took in seconds.

    `fast`: in m/s, what shares of slip are of. `slips`: the gyroscope has found out that the wheels do not hold.
    `unseen`: seconds for which they have not by its end and nobody knew.
    """

    pose: Pose2
    seconds: float
    fast: float
    slips: bool = False
    unseen: float = 0.0

    @property
    def length(self) -> float:
        """Meters."""
        return math.hypot(self.pose.x, self.pose.y)


@dataclass(frozen=True)
class Model:
    """Jacobian `f` (7, 7) of a step, and the covariance `q` (7, 7) that it adds."""

    f: Array
    q: Array


def rates(spec: SlipEkf, step: Step, noise: float, slipped: bool) -> Model:
    """What becomes of turn rate, bias and slip from one step to the next.

    `noise`: variance of the turn rate that the wheels say. `slipped`: they did not hold in the step before.
    """
    f, q = np.eye(7), np.zeros((7, 7))
    f[RATE, RATE], q[RATE, RATE] = 0.0, UNKNOWN_RATE**2 if step.slips else noise
    q[BIAS, BIAS] = spec.gyro_bias_walk**2 * step.seconds
    if step.slips != slipped:
        f[AHEAD, AHEAD] = f[ASIDE, ASIDE] = 0.0
        q[AHEAD, AHEAD], q[ASIDE, ASIDE] = (SHARE**2, SHARE**2) if step.slips else (spec.wheel_slip**2, 0.0)
    elif not step.slips:
        f[AHEAD, AHEAD] = math.exp(-step.seconds / SLIP_LASTS)
        q[AHEAD, AHEAD] = spec.wheel_slip**2 * (1.0 - f[AHEAD, AHEAD] ** 2)
    return Model(f, q)


def moved(state: Array, step: Step) -> Array:
    """The state (7,) after a step of the wheels; a turn other than theirs turns its chord by half the difference."""
    after: Array = state.copy()
    after[[X, Y]] += _way(state, step)
    after[YAW] = math.remainder(state[YAW] + state[RATE] * step.seconds, 2 * math.pi)
    return after


def motion(spec: SlipEkf, state: Array, step: Step) -> Model:
    """How the errors of the state before a step become those of the pose after it."""
    dx, dy = _way(state, step)
    c, s = _along(state, step)
    f, q = np.eye(7), np.zeros((7, 7))
    f[:2, YAW] = -dy, dx
    f[:3, RATE] = -dy * step.seconds / 2, dx * step.seconds / 2, step.seconds
    slid = step.fast * (step.unseen or step.seconds)
    f[:2, AHEAD], f[:2, ASIDE] = (c * slid, s * slid), (-s * slid, c * slid)
    if step.length > 0:
        wheels = c * step.pose.x - s * step.pose.y, s * step.pose.x + c * step.pose.y
        q[:2, :2] = spec.translation_noise**2 / step.length * np.outer(wheels, wheels)
    return Model(f, q)


def _along(state: Array, step: Step) -> tuple[float, float]:
    """Cosine and sine of the heading along which the step goes."""
    along = float(state[YAW] + (state[RATE] * step.seconds - step.pose.yaw) / 2)
    return math.cos(along), math.sin(along)


def _way(state: Array, step: Step) -> tuple[float, float]:
    """How far the robot gets along x and y of the map."""
    c, s = _along(state, step)
    slid = step.fast * step.seconds
    x, y = step.pose.x + float(state[AHEAD]) * slid, step.pose.y + float(state[ASIDE]) * slid
    return c * x - s * y, s * x + c * y
