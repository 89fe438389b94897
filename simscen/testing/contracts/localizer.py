"""Contract of localizers: checks that every localizer must pass."""

from __future__ import annotations

from functools import cache

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry
from simscen.stack.protocols import Localizer
from simscen.testing.contracts.base import Contract, call_component, promise, require
from simscen.testing.synthetic_room import (
    BEAMS,
    Noise,
    RoomDrive,
    build_localizer,
    drive,
    drive_along,
    pose_errors,
    run_localizer,
    scan,
)

NO_NOISE = Noise(lidar=0, translation=0, rotation=0, drift=0, gyro=0, gyro_bias=0)


@cache
def short_drive() -> RoomDrive:
    """Return a drive of 6 s through the room of synthetic_room.py."""
    return drive(6.0)


def start_estimate() -> Estimate:
    """Return the true start pose of the short drive as initial pose estimate, with standard deviations."""
    return Estimate(Pose2(*short_drive().truth[0]), (0.1, 0.1, 0.05))


class LocalizerContract(Contract):
    """Contract of a localizer, in a room of 10 m by 8 m with a lidar of 360 beams at 10 Hz and odometry at 40 Hz."""

    role = "localizer"

    def build_at(self, estimate: Estimate) -> Localizer:
        """Build a localizer, and reset it to this initial pose estimate."""
        subject = call_component("is built", lambda: build_localizer(self.spec, estimate, 1))
        call_component("is reset", lambda: subject.reset(estimate))
        return subject

    @promise
    def the_same_calls_give_the_same_beliefs_bit_for_bit(self) -> None:
        """Given the same readings and the same seed then the beliefs are bit-identical."""
        for pose in (start_estimate().pose, None):
            first, again = (
                call_component("localizes", run_localizer, self.build_at(Estimate(pose)), short_drive(), 4, imu=True)
                for _ in range(2)
            )
            for one, other in zip(first, again, strict=True):
                require(one.pose == other.pose and one.map_from_odom == other.map_from_odom, "two runs differ in pose")
                require(np.array_equal(one.covariance, other.covariance), "two runs differ in covariance")
                require(np.array_equal(one.particles, other.particles), "two runs differ in particles")

    @promise
    def without_motion_the_belief_does_not_drift(self) -> None:
        """Given no motion and exact readings then the belief stays within 5 cm and 0.03 rad of the true pose."""
        standstill = drive_along(np.tile(short_drive().truth[:1], (400, 1)))
        start = Estimate(start_estimate().pose, (0.02, 0.02, 0.01))
        beliefs = call_component(
            "localizes", lambda: run_localizer(self.build_at(start), standstill, 1, NO_NOISE, imu=True)
        )
        error = pose_errors(beliefs, standstill.truth)
        offset, turn = float(np.abs(error[:, :2]).max()), float(np.abs(error[:, 2]).max())
        require(offset < 0.05, f"drifts by {offset:.3f} m while the robot stands")
        require(turn < 0.03, f"drifts by {turn:.3f} rad while the robot stands")

    @promise
    def a_belief_does_not_change_after_it_was_given(self) -> None:
        """Given a returned belief then later readings do not change its arrays."""
        subject = self.build_at(start_estimate())
        send_odometry(subject, 0, Pose2(0, 0, 0))
        belief = valid_belief(subject)
        covariance, particles = belief.covariance.copy(), belief.particles.copy()
        for k in range(1, 20):
            send_odometry(subject, k, Pose2(0.3 * k, 0, 0.1 * k))
            call_component("receives a scan", subject.on_scan, scan(short_drive().ranges[k], 24 * k))
        require(np.array_equal(belief.covariance, covariance), "a covariance changes after it was returned")
        require(np.array_equal(belief.particles, particles), "particles change after they were returned")

    @promise
    def a_scan_is_neither_changed_nor_kept(self) -> None:
        """Given a scan then its ranges are not changed, and later changes of its ranges do not affect the belief."""
        subject, ranges = self.build_at(start_estimate()), short_drive().ranges[0].copy()
        call_component("receives a scan", lambda: subject.on_scan(scan(ranges, 24)))
        require(np.array_equal(ranges, short_drive().ranges[0]), "changes the ranges of a scan")
        ranges[:] = np.nan
        send_odometry(subject, 1, Pose2(0, 0, 0))
        other = self.build_at(start_estimate())
        call_component("receives a scan", lambda: other.on_scan(scan(short_drive().ranges[0], 24)))
        send_odometry(other, 1, Pose2(0, 0, 0))
        require(subject.belief.pose == other.belief.pose, "a later change of a scan affects the belief")

    @promise
    def invalid_ranges_never_make_the_belief_invalid(self) -> None:
        """Given ranges that are nan, infinite, negative, or huge then the belief stays finite and semidefinite."""
        for start in (start_estimate(), Estimate(None)):
            subject = self.build_at(start)
            for k in range(30):
                send_odometry(subject, k, Pose2(0.3 * k, 0.01 * k, 0.3 * k))
                call_component("receives a scan", subject.on_scan, scan(_invalid_ranges(k % 14), 24 * k))
                valid_belief(subject)

    @promise
    def invalid_odometry_never_makes_the_belief_invalid(self) -> None:
        """Given odometry and yaw rates of nan, infinity, or 1e300 then the belief stays finite and semidefinite."""
        subject, rng = self.build_at(start_estimate()), np.random.default_rng(5)
        for k in range(40):
            x, y, yaw = rng.choice([0.0, np.nan, np.inf, -np.inf, 1e300, -9e5, 4.0, 1e-300], 3).tolist()
            rate = float(rng.choice([np.nan, np.inf, 99.0, -1e9]))
            imu = Imu("imu", 24 * k, (0.0, 0.0, rate), (0.0, 0.0, 9.8))
            call_component("receives a turn rate", subject.on_imu, imu)
            send_odometry(subject, k, Pose2(x, y, yaw))
            call_component("receives a scan", subject.on_scan, scan(short_drive().ranges[k % 20], 24 * k))
            valid_belief(subject)

    @promise
    def scans_of_any_size_range_and_mount_are_accepted(self) -> None:
        """Given a scan with 0 to 4096 beams and any maximum range then the belief stays finite and semidefinite."""
        subject = self.build_at(start_estimate())
        for k, size in enumerate((0, 1, 2, 3, 59, 60, 61, 4096)):
            send_odometry(subject, k, Pose2(0.3 * k, 0, 0))
            limits = {"range_max": [12.0, 0.0, np.nan, 1e6][k % 4], "mount": Pose2(0.3, -2.0, 5.0)}
            call_component("receives a scan", subject.on_scan, scan(np.full(size, 2.0), 24 * k, **limits))
            valid_belief(subject)

    @promise
    def a_reset_forgets_everything(self) -> None:
        """Given a reset then the belief is within three standard deviations of the estimate."""
        subject = self.build_at(Estimate(Pose2(3, 3, 3)))
        whole = short_drive()
        first_part = RoomDrive(whole.truth[:80], whole.steps[:80], whole.ranges[:20])
        call_component("localizes", lambda: run_localizer(subject, first_part, 1, imu=True))
        call_component("is reset", lambda: subject.reset(start_estimate()))
        require_near_start(valid_belief(subject), "after a reset")
        send_odometry(subject, 0, Pose2(-8, 4, 2))
        require_near_start(valid_belief(subject), "after a reset and the first odometry")


def require_near_start(belief: Belief, occasion: str) -> None:
    """Raise PromiseBroken if the belief is more than three standard deviations from `start_estimate()`.

    `occasion` is the end of the message, such as "after a reset".
    """
    start = start_estimate()
    assert start.pose is not None
    x, y, yaw = np.abs(tuple(start.pose.between(belief.pose))).tolist()
    is_near = max(x, y) <= 3 * start.std[0] and yaw <= 3 * start.std[2]
    require(is_near, f"believes to be at {belief.pose} {occasion}, but was reset to {start.pose}")


def send_odometry(subject: Localizer, number: int, pose: Pose2) -> None:
    """Send an odometry reading with this pose to the localizer, with the tick of scan `number`."""
    call_component("receives odometry", lambda: subject.on_odometry(Odometry("odom", 24 * number, pose, Twist())))


def valid_belief(subject: Localizer) -> Belief:
    """Return the belief of the localizer. Raises PromiseBroken if the belief is invalid.

    Pose, covariance, and particles must be finite, the covariance positive semidefinite, and the sum of weights 1.
    """
    belief: Belief = call_component("returns its belief", lambda: subject.belief)
    require(isinstance(belief, Belief), f"returns {type(belief).__name__}, not a Belief")
    covariance, particles = belief.covariance, belief.particles
    require(np.isfinite([*belief.pose, *belief.map_from_odom]).all(), f"believes to be at {belief.pose}")
    require(covariance.shape == (3, 3) and np.isfinite(covariance).all(), "returns a covariance that is not finite")
    require(np.allclose(covariance, covariance.T), "returns a covariance that is not symmetric")
    min_eigenvalue = float(np.linalg.eigvalsh(covariance).min())
    require(
        min_eigenvalue >= -1e-9 * float(np.trace(covariance)), "returns a covariance that is not positive semidefinite"
    )
    require(
        particles.shape[1:] == (4,) and np.isfinite(particles).all(),
        "returns particles that are not finite (n, 4)",
    )
    weight = float(particles[:, 3].sum())
    require(not len(particles) or abs(weight - 1) < 1e-9, f"returns weights that add up to {weight:g}")
    return belief


def _invalid_ranges(seed: int) -> Array:
    """Return the ranges (BEAMS,) of a scan, most of them invalid. Each `seed` from 0 to 13 gives different ranges."""
    rng = np.random.default_rng(seed)
    kinds = [np.nan, np.inf, -np.inf, 0.0, -5.0, 1e300, 12.0, 0.05, 3.0]
    mixed = rng.choice([np.nan, np.inf, -1.0, 1e9, 2.0, 0.3], BEAMS)
    return np.full(BEAMS, kinds[seed]) if seed < len(kinds) else rng.choice([mixed, rng.uniform(0, 12, BEAMS)])
