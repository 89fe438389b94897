"""Tests of when AMCL updates its filter, and of unusable sensor data."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.localizers import Amcl
from simscen.stack.localizers.build import amcl
from simscen.stack.protocols import Localizer
from simscen.stack.setting import Setting
from simscen.testing.synthetic_room import BEAMS, build_localizer, cast, drive, grid, scan, surroundings

START = Pose2(-2.5, -1.8, 0.6)
DEFAULT = Amcl()
GUESS = Estimate(Pose2(-2.3, -1.9, 0.5), (0.3, 0.3, 0.2))


def seen(pose: Pose2, tick: int, **changes: object) -> Scan:
    return scan(cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0], tick, **changes)


def odometry(tick: int, pose: Pose2) -> Odometry:
    return Odometry("odom", tick, pose, Twist())


def started(spec: Amcl = DEFAULT, **changes: object) -> Localizer:
    """A localizer that has had its first odometry and its first scan."""
    subject = build_localizer(spec, GUESS, 1)
    subject.on_odometry(odometry(0, Pose2(0, 0, 0)))
    subject.on_scan(seen(START, 0, **changes))
    return subject


def moved(subject: Localizer, tick: int, step: Pose2, **changes: object) -> Belief:
    """After an honest step from the start."""
    subject.on_odometry(odometry(tick, step))
    subject.on_scan(seen(START.compose(step), tick, **changes))
    return subject.belief


def test_first_scan_updates_without_motion() -> None:
    error = START.between(started().belief.pose)
    assert np.hypot(error.x, error.y) < 0.1
    assert abs(error.yaw) < 0.06


@pytest.mark.parametrize(
    ("step", "corrects"),
    [(Pose2(0.24, 0, 0.19), False), (Pose2(0.26, 0, 0), True), (Pose2(-0.2, 0.2, 0), True), (Pose2(0, 0, -0.21), True)],
)
def test_scan_updates_only_after_enough_motion(step: Pose2, corrects: bool) -> None:
    belief = moved(started(), 24, step)
    assert belief.updated == (24 if corrects else 0)


def test_pose_follows_odometry_with_growing_uncertainty_between_updates() -> None:
    subject = started()
    before = subject.belief
    subject.on_odometry(odometry(6, Pose2(0.1, 0.02, 0.05)))
    after = subject.belief
    assert after.pose == pytest.approx(before.pose.compose(Pose2(0.1, 0.02, 0.05)))
    assert after.map_from_odom == before.map_from_odom
    assert np.linalg.eigvalsh(after.covariance - before.covariance).max() > 0
    assert np.trace(after.covariance) > np.trace(before.covariance)


def test_each_lidar_updates_once_after_enough_motion() -> None:
    """As nav2_amcl, which keeps a flag for each laser."""
    subject, step = started(), Pose2(0.26, 0, 0)
    subject.on_scan(replace(seen(START, 0), sensor="rear"))
    assert moved(subject, 24, step).updated == 24
    subject.on_odometry(odometry(25, step))
    subject.on_scan(replace(seen(START.compose(step), 25), sensor="rear"))
    assert subject.belief.updated == 25
    subject.on_odometry(odometry(26, step))
    subject.on_scan(replace(seen(START.compose(step), 26), sensor="rear"))
    assert subject.belief.updated == 25


def test_a_scan_waits_for_the_odometry_of_its_tick() -> None:
    """The order in which the readings of a beat are handed over makes no difference."""
    early, late = started(), started()
    expected = moved(early, 24, Pose2(0.3, 0, 0.1))
    late.on_scan(seen(START.compose(Pose2(0.3, 0, 0.1)), 24))
    assert late.belief.updated == 0
    late.on_odometry(odometry(24, Pose2(0.3, 0, 0.1)))
    assert late.belief.pose == expected.pose
    assert np.array_equal(late.belief.particles, expected.particles)


def test_late_scan_updates_the_pose_of_its_measurement() -> None:
    punctual, delayed = started(), started()
    steps = [(24, Pose2(0.3, 0, 0)), (48, Pose2(0.6, 0, 0.3))]
    for tick, step in steps:
        punctual.on_odometry(odometry(tick, step))
        delayed.on_odometry(odometry(tick, step))
        if tick == 24:
            punctual.on_scan(seen(START.compose(step), tick))
    delayed.on_scan(seen(START.compose(steps[0][1]), 24))
    assert delayed.belief.pose == pytest.approx(punctual.belief.pose)


def test_scans_older_than_all_odometry_are_ignored() -> None:
    subject = build_localizer(Amcl(), GUESS, 1)
    subject.on_odometry(odometry(100, Pose2(0, 0, 0)))
    subject.on_scan(seen(START, 50))
    assert subject.belief.updated == 0


def test_number_of_particles_decreases_from_maximum_to_minimum() -> None:
    spec = Amcl(min_particles=100, max_particles=3000, laser_model_type="likelihood_field_prob")
    subject = build_localizer(spec, GUESS, 1)
    assert len(subject.belief.particles) == 3000
    for tick, row in enumerate(drive(20.0).truth[::20]):
        subject.on_odometry(odometry(tick, Pose2(*drive(20.0).truth[0]).between(Pose2(*row))))
        subject.on_scan(seen(Pose2(*row), tick))
    assert 100 <= len(subject.belief.particles) < 200


def weights_after(spec: Amcl, updates: int) -> np.ndarray:
    subject = started(spec)
    for k in range(1, updates):
        moved(subject, 24 * k, Pose2(0.3 * (k % 2), 0, 0))
    return subject.belief.particles[:, 3]


@pytest.mark.parametrize(("updates", "equal"), [(1, False), (2, False), (3, True), (4, False)])
def test_resampling_happens_at_the_resample_interval(updates: int, equal: bool) -> None:
    assert (np.ptp(weights_after(Amcl(resample_interval=3), updates)) == 0) == equal


def test_selective_resampling_waits_for_half_the_effective_particles() -> None:
    patient = weights_after(Amcl(selective_resampling=True, laser_model_type="likelihood_field"), 1)
    assert np.ptp(patient) > 0
    assert 1 / (patient @ patient) > len(patient) / 2
    sharp = Amcl(selective_resampling=True, laser_model_type="likelihood_field_prob")
    assert np.ptp(weights_after(sharp, 1)) == 0


@pytest.mark.parametrize("ranges", [np.full(BEAMS, np.nan), np.full(BEAMS, np.inf), np.full(BEAMS, -3.0), np.empty(0)])
def test_particles_spread_with_odometry_while_the_lidar_is_blind(ranges: np.ndarray) -> None:
    subject = started()
    for k in range(1, 20):
        subject.on_odometry(odometry(24 * k, Pose2(0.3 * k, 0, 0)))
        subject.on_scan(scan(ranges, 24 * k))
    blind, sighted = subject.belief, started().belief
    assert blind.map_from_odom == pytest.approx(sighted.map_from_odom)
    assert blind.updated == 0
    assert np.trace(blind.covariance) > 5 * np.trace(sighted.covariance)


def test_scan_that_fits_no_particle_gives_equal_weights() -> None:
    """With z_rand = 0 and a narrow hit every particle off the walls has probability zero."""
    spec = Amcl(laser_model_type="likelihood_field_prob", z_rand=0.0, sigma_hit=0.01, recovery_alpha_slow=0.001,
                recovery_alpha_fast=0.1)  # fmt: skip
    subject = started(spec, range_max=5.0)
    subject.on_odometry(odometry(24, Pose2(0.3, 0, 0)))
    subject.on_scan(scan(np.random.default_rng(1).uniform(0.2, 4, BEAMS), 24))
    belief = subject.belief
    assert np.isfinite(belief.covariance).all()
    assert np.ptp(belief.particles[:, 3]) == 0


def test_vanishing_weights_become_equal() -> None:
    """Sixty sure beams and a hundred scans between two draws leave less than the smallest number."""
    spec = Amcl(laser_model_type="likelihood_field_prob", z_rand=1e-6, sigma_hit=0.02, resample_interval=100)
    subject = started(spec)
    for k in range(1, 60):
        belief = moved(subject, 24 * k, Pose2(0.3 * (k % 2), 0, 0))
        assert np.isfinite(belief.covariance).all()
        assert belief.particles[:, 3].sum() == pytest.approx(1)


def test_a_reset_starts_over_at_the_next_odometry() -> None:
    subject = started()
    moved(subject, 24, Pose2(0.3, 0, 0))
    subject.reset(Estimate(Pose2(1, 1, 1), (0.1, 0.2, 0.3)))
    assert subject.belief.pose == Pose2(1, 1, 1)
    assert np.allclose(subject.belief.covariance, np.diag([0.01, 0.04, 0.09]))
    subject.on_odometry(odometry(3, Pose2(7, 7, 7)))
    assert subject.belief.pose == pytest.approx((1, 1, 1))


def test_particles_cover_the_free_space_without_an_estimate() -> None:
    belief = build_localizer(Amcl(), Estimate(None), 1).belief
    assert (grid().values_at(belief.particles[:, :2]) == 0).all()
    assert np.sqrt(np.diag(belief.covariance)).min() > 1


def test_rotated_map_gives_the_same_result() -> None:
    """Cell borders fall differently, so a little differs; the place does not."""
    straight, turn = surroundings().map, Pose2(3.0, -2.0, 0.7)
    assert straight is not None
    turned = replace(surroundings(), map=replace(straight, origin=turn.compose(straight.origin)))
    start = Estimate(turn.compose(Pose2(-2.3, -1.9, 0.5)), (0.3, 0.3, 0.2))
    subject = amcl(Amcl(), Setting(turned, "localizer", Streams(1), estimate=start))
    subject.on_odometry(odometry(0, Pose2(0, 0, 0)))
    subject.on_scan(seen(START, 0))
    error = turn.compose(START).between(subject.belief.pose)
    assert np.hypot(error.x, error.y) < 0.1


@pytest.mark.parametrize("kind", ["likelihood_field", "likelihood_field_prob", "beam"])
@pytest.mark.parametrize("farthest", [-1.0, 0.0])
def test_unset_maximum_range_is_that_of_the_lidar(kind: str, farthest: float) -> None:
    """As in nav2_amcl, where only what is above zero cuts ranges."""
    usual, subject = (
        started(Amcl.model_validate({"laser_model_type": kind, "max_particles": 100, "min_particles": 20, **given}))
        for given in ({}, {"laser_max_range": farthest})
    )
    assert subject.belief.pose == usual.belief.pose
    assert moved(subject, 24, Pose2(0.3, 0, 0)).pose == moved(usual, 24, Pose2(0.3, 0, 0)).pose


def test_zero_standard_deviation_is_refused() -> None:
    """Its square would be zero, which is a singular covariance."""
    with pytest.raises(ValidationError, match="sigma_hit"):
        Amcl(sigma_hit=1e-30)
