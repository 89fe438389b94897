"""Odometry and a gyroscope in an extended Kalman filter: dead reckoning that notices when its wheels slip in a turn.

Probabilistic Robotics, section 3.3, with filterpy's ExtendedKalmanFilter (Labbe). As robot_localization does, the
turn rate is a state that both sensors measure; the gyroscope's bias is one too, and shows while the robot stands.
"""

import math

import numpy as np

from simscen.advanced.localizers.laser_odometry import LaserOdometry
from simscen.advanced.localizers.slip_detector import SlipDetector
from simscen.advanced.localizers.slip_model import AHEAD, BIAS, LEVER, PUSHED, RATE, Model, Step, motion, moved, rates
from simscen.advanced.localizers.spec import SlipEkf
from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.stack.localizers.dead_reckoning import start_of
from simscen.stack.odometry_history import is_plausible

# No robot turns faster than this, in rad/s: a gyroscope that says so is broken.
_FASTEST = 100.0
# rad/s. Encoders that say "nothing" have seen less than a tick of theirs, not nothing: without this floor wheels that
# are locked, or stand on a turntable, would be believed whatever the gyroscope says.
_LEAST_RATE_NOISE = 0.002
# It measures the turn rate and its own bias.
_GYRO = np.zeros((1, 7))
_GYRO[0, [RATE, BIAS]] = 1.0


class SlipEkfLocalizer:
    """Adds up odometry's translations along a heading that odometry and gyroscope agree on. No map: it drifts.

    Where they disagree by more than their noise the wheels slip: the step turns as the gyroscope says, and how far the
    robot got is as uncertain as it was fast.
    """

    def __init__(self, spec: SlipEkf, estimate: Estimate, tick_rate: int) -> None:
        self._spec, self._tick_rate = spec, tick_rate
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate, with a bias of which nothing more is known than how large it may be."""
        from filterpy.kalman import ExtendedKalmanFilter

        pose, covariance = start_of(estimate)
        bias = self._spec.gyro_noise if self._spec.gyro_bias is None else self._spec.gyro_bias
        self._filter = ExtendedKalmanFilter(dim_x=7, dim_z=1)
        self._filter.predict_x = self._advance
        self._filter.x = np.array([*pose, 0.0, 0.0, 0.0, 0.0])
        self._filter.P = np.zeros((7, 7))
        self._filter.P[:RATE, :RATE] = covariance
        self._filter.P[BIAS, BIAS], self._filter.P[AHEAD, AHEAD] = bias**2, self._spec.wheel_slip**2
        self._last: Odometry | None = None
        self._readings: list[float] = []
        self._speed, self._slipped = 0.0, False
        self._watch = SlipDetector()
        self._map_from_odom = pose
        self._laser = LaserOdometry(self._tick_rate) if self._spec.match_scans else None

    def on_odometry(self, odometry: Odometry) -> None:
        """Take a step along the heading that both sensors agree on."""
        last = self._last
        if not is_plausible(odometry.pose) or (last is not None and odometry.tick <= last.tick):
            return
        self._last = odometry
        if last is not None:
            step = self._judged(last.pose.between(odometry.pose), (odometry.tick - last.tick) / self._tick_rate)
            self._measure(step)
            self._predict(motion(self._spec, self._filter.x, step), moved(self._filter.x, step))
        self._readings.clear()
        if self._laser is not None:
            self._laser.reckon(odometry.tick, self.pose)
        self._map_from_odom = self.pose.compose(odometry.pose.inverse())

    def on_scan(self, scan: Scan) -> None:
        """Correct how far the robot came, where scans are matched."""
        if self._laser is None or self._last is None:
            return
        x, y = self._laser.correction(scan)
        self._filter.x[0] += x
        self._filter.x[1] += y
        self._map_from_odom = self.pose.compose(self._last.pose.inverse())

    def on_imu(self, imu: Imu) -> None:
        """Keep the turn rate until the next odometry."""
        rate = imu.angular_velocity[2]
        if abs(rate) < _FASTEST:
            self._readings.append(rate)

    @property
    def belief(self) -> Belief:
        """The state at the newest odometry."""
        covariance: Array = self._filter.P[:RATE, :RATE].copy()
        tick = self._last.tick if self._last is not None else 0
        return Belief(self.pose, (covariance + covariance.T) / 2, self._map_from_odom, updated=tick)

    @property
    def pose(self) -> Pose2:
        """That of the belief."""
        x, y, yaw = self._filter.x[:RATE].tolist()
        return Pose2(x, y, wrap(yaw))

    def _judged(self, pose: Pose2, seconds: float) -> Step:
        """The step, and whether the gyroscope disagrees with the wheels about it by more than their noise."""
        speed = math.hypot(pose.x, pose.y) / seconds
        held = Step(pose, seconds, speed)
        if not self._readings:
            return held
        turn = self._turning - float(self._filter.x[BIAS])
        innovation, noise = turn - pose.yaw / seconds, self._wheel_noise(held) + self._gyro_noise
        unseen = self._watch.slipped(innovation, noise, float(self._filter.P[BIAS, BIAS]), seconds)
        if unseen == 0.0:
            return held
        pushed = PUSHED if abs(turn) > abs(pose.yaw / seconds) else 0.0
        fast = max(self._speed, speed, LEVER * abs(innovation), pushed)
        return Step(pose, seconds, fast, slips=True, unseen=unseen)

    def _measure(self, step: Step) -> None:
        """The turn rate of this step, out of odometry's turn, where the wheels hold, and the gyroscope's readings."""
        model = rates(self._spec, step, self._wheel_noise(step), self._slipped)
        after = model.f @ self._filter.x
        after[RATE] = step.pose.yaw / step.seconds
        self._predict(model, after)
        if self._readings:
            self._filter.update(
                np.array([self._turning]),
                lambda _: _GYRO,
                lambda state: _GYRO @ state,
                R=np.array([[self._gyro_noise]]),
            )
        self._slipped = step.slips
        if not step.slips:
            self._speed = step.fast

    def _wheel_noise(self, step: Step) -> float:
        """Variance of the turn rate by the wheels."""
        turned = step.length + abs(step.pose.yaw)
        return self._spec.rotation_noise**2 * turned / step.seconds**2 + _LEAST_RATE_NOISE**2

    @property
    def _turning(self) -> float:
        """What the gyroscope says of this step."""
        return sum(self._readings) / len(self._readings)

    @property
    def _gyro_noise(self) -> float:
        return self._spec.gyro_noise**2 / len(self._readings)

    def _predict(self, model: Model, after: Array) -> None:
        self._filter.F, self._filter.Q = model.f, model.q
        self._filter.predict(after)

    def _advance(self, after: Array) -> None:
        """The place that filterpy leaves for a motion that is not linear."""
        self._filter.x = after
