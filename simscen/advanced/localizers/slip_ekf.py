"""Extended Kalman filter of odometry and gyroscope that detects wheel slip in turns, with optional scan matching.

Source: Probabilistic Robotics, section 3.3, with filterpy's ExtendedKalmanFilter. As in robot_localization, the turn
rate is a state that both wheels and gyroscope measure. The bias of the gyroscope is also a state.
"""

import math

import numpy as np

from simscen.advanced.localizers.scan_matcher import ScanMatcher
from simscen.advanced.localizers.slip_model import (
    BIAS,
    PUSHED_SPEED_M_S,
    RATE,
    SLIP_LEVER_M,
    SLIP_X,
    SlipDetector,
    WheelStep,
    pose_model,
    predict_state,
    rate_model,
)
from simscen.advanced.spec import SlipEkf
from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.stack.localizers.ekf import MIN_YAW_RATE_STD_RAD_S, EkfLocalizer
from simscen.stack.odometry_history import OdometryHistory


class ScanMatchingCorrection:
    """Corrects the translation of dead reckoning between scans of one lidar, but not the heading."""

    def __init__(self, tick_rate: int) -> None:
        self._matcher = ScanMatcher()
        self._dead_reckoning = OdometryHistory(tick_rate)
        self._x = self._y = 0.0
        """Sum of all corrections in m, in the map frame."""
        self._previous: tuple[str, Pose2] | None = None
        """Name of the lidar, and pose by dead reckoning at the last scan of this lidar."""

    def add_pose(self, tick: int, pose: Pose2) -> None:
        """Add a pose of dead reckoning in the map frame, which includes all corrections so far."""
        self._dead_reckoning.add(tick, Pose2(pose.x - self._x, pose.y - self._y, pose.yaw))

    def correction(self, scan: Scan) -> tuple[float, float]:
        """Return the translation (x, y) in m, in the map frame, that corrects dead reckoning since the last scan.

        The result is 0 if scan matching fails or differs too much from dead reckoning (see `MatchedMotion.agrees`).
        At least one pose must have been added.
        """
        current = self._dead_reckoning.latest_until(scan.tick)
        sensor, previous = self._previous or (scan.sensor, current)
        if scan.sensor != sensor:
            return 0.0, 0.0
        self._previous = sensor, current
        driven = previous.between(current)
        step = self._matcher.step(scan, driven)
        if step is None or not step.agrees(driven):
            return 0.0, 0.0
        forward, left = step.delta.x - driven.x, step.delta.y - driven.y
        c, s = math.cos(previous.yaw), math.sin(previous.yaw)
        x, y = c * forward - s * left, s * forward + c * left
        self._x, self._y = self._x + x, self._y + y
        return x, y


_GYRO_MEASUREMENT = np.zeros((1, 7))
"""Measurement matrix of the gyroscope, which measures the sum of turn rate and bias."""
_GYRO_MEASUREMENT[0, [RATE, BIAS]] = 1.0


class SlipEkfLocalizer(EkfLocalizer):
    """Localizer by dead reckoning with wheels and gyroscope, without a map.

    If the turn rates of wheels and gyroscope disagree by more than their noise, the wheels slip. Then only the
    gyroscope determines the turn, and the uncertainty of the translation increases with the speed.
    """

    _spec: SlipEkf
    _bias_index = BIAS

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate, with the initial uncertainty of the gyroscope's bias."""
        super().reset(estimate)
        self._filter.P[SLIP_X, SLIP_X] = self._spec.wheel_slip**2
        self._speed = 0.0
        """Speed in m/s in the last step without slip."""
        self._slipped = False
        """Whether the wheels slipped in the last step."""
        self._slip_detector = SlipDetector()
        self._scan_correction = ScanMatchingCorrection(self._tick_rate) if self._spec.match_scans else None

    def on_odometry(self, odometry: Odometry) -> None:
        """Estimate the turn rate, and propagate the pose to the time of an odometry reading."""
        super().on_odometry(odometry)
        if self._scan_correction is not None and self._last is odometry:
            self._scan_correction.add_pose(odometry.tick, self.pose)

    def on_scan(self, scan: Scan) -> None:
        """Correct the translation by scan matching, if enabled."""
        if self._scan_correction is None or self._last is None:
            return
        x, y = self._scan_correction.correction(scan)
        self._filter.x[0] += x
        self._filter.x[1] += y
        self._map_from_odom = self.pose.compose(self._last.pose.inverse())

    def _advance(self, step: Pose2, seconds: float) -> None:
        """Estimate the turn rate, and propagate the pose by `step`, which the wheels measured in the last `seconds`."""
        wheels = self._wheel_step(step, seconds)
        self._measure(wheels)
        self._predict(predict_state(self._filter.x, wheels), *pose_model(self._spec, self._filter.x, wheels))

    def _wheel_step(self, motion: Pose2, seconds: float) -> WheelStep:
        """Return the step of `seconds` in which the wheels measure `motion`, with the slip that is detected."""
        speed = math.hypot(motion.x, motion.y) / seconds
        without_slip = WheelStep(motion, seconds, speed)
        if not self._yaw_rates:
            return without_slip
        turn = self._turn_rate - float(self._filter.x[BIAS])
        innovation, noise = turn - motion.yaw / seconds, self._turn_rate_noise(without_slip) + self._gyro_noise
        undetected = self._slip_detector.update(innovation, noise, float(self._filter.P[BIAS, BIAS]), seconds)
        if undetected == 0.0:
            return without_slip
        pushed_speed = PUSHED_SPEED_M_S if abs(turn) > abs(motion.yaw / seconds) else 0.0
        possible_speed = max(self._speed, speed, SLIP_LEVER_M * abs(innovation), pushed_speed)
        return WheelStep(motion, seconds, possible_speed, slips=True, undetected_slip=undetected)

    def _measure(self, step: WheelStep) -> None:
        """Update the turn rate with the wheels, unless they slip, and with the gyroscope."""
        jacobian, noise = rate_model(self._spec, step, self._turn_rate_noise(step), self._slipped)
        predicted = jacobian @ self._filter.x
        predicted[RATE] = step.motion.yaw / step.seconds
        self._predict(predicted, jacobian, noise)
        if self._yaw_rates:
            self._update(np.array([self._turn_rate]), _GYRO_MEASUREMENT, np.array([[self._gyro_noise]]))
        self._slipped = step.slips
        if not step.slips:
            self._speed = step.speed

    def _turn_rate_noise(self, step: WheelStep) -> float:
        """Return the variance of the turn rate of the wheels in (rad/s)²."""
        turned = step.length + abs(step.motion.yaw)
        return self._spec.rotation_noise**2 * turned / step.seconds**2 + MIN_YAW_RATE_STD_RAD_S**2

    @property
    def _turn_rate(self) -> float:
        """Mean reading of the gyroscope since the last odometry reading, in rad/s."""
        return sum(self._yaw_rates) / len(self._yaw_rates)

    @property
    def _gyro_noise(self) -> float:
        """Variance of `_turn_rate` in (rad/s)²."""
        return self._spec.gyro_noise**2 / len(self._yaw_rates)
