"""Tests of AMCL: when scans update the filter, particle numbers, unusable scans, and resets."""

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


def scan_from(pose: Pose2, tick: int, **changes: object) -> Scan:
    return scan(cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0], tick, **changes)


def odometry(tick: int, pose: Pose2) -> Odometry:
    return Odometry("odom", tick, pose, Twist())


def started_localizer(spec: Amcl = DEFAULT, **changes: object) -> Localizer:
    """Return a localizer that has received its first odometry and its first scan."""
    localizer = build_localizer(spec, GUESS, 1)
    localizer.on_odometry(odometry(0, Pose2(0, 0, 0)))
    localizer.on_scan(scan_from(START, 0, **changes))
    return localizer


def belief_after(localizer: Localizer, tick: int, step: Pose2, **changes: object) -> Belief:
    """Return the belief after a step from the start with exact odometry."""
    localizer.on_odometry(odometry(tick, step))
    localizer.on_scan(scan_from(START.compose(step), tick, **changes))
    return localizer.belief


def test_first_scan_updates_without_motion() -> None:
    error = START.between(started_localizer().belief.pose)
    assert np.hypot(error.x, error.y) < 0.1
    assert abs(error.yaw) < 0.06


@pytest.mark.parametrize(
    ("step", "is_updated"),
    [(Pose2(0.24, 0, 0.19), False), (Pose2(0.26, 0, 0), True), (Pose2(-0.2, 0.2, 0), True), (Pose2(0, 0, -0.21), True)],
)
def test_scan_updates_only_after_enough_motion(step: Pose2, is_updated: bool) -> None:
    belief = belief_after(started_localizer(), 24, step)
    assert belief.updated == (24 if is_updated else 0)


def test_pose_follows_odometry_with_growing_uncertainty_between_updates() -> None:
    localizer = started_localizer()
    before = localizer.belief
    localizer.on_odometry(odometry(6, Pose2(0.1, 0.02, 0.05)))
    after = localizer.belief
    assert after.pose == pytest.approx(before.pose.compose(Pose2(0.1, 0.02, 0.05)))
    assert after.map_from_odom == before.map_from_odom
    assert np.linalg.eigvalsh(after.covariance - before.covariance).max() > 0
    assert np.trace(after.covariance) > np.trace(before.covariance)


def test_each_lidar_updates_once_after_enough_motion() -> None:
    """Like nav2_amcl, which has a flag for each lidar."""
    localizer, step = started_localizer(), Pose2(0.26, 0, 0)
    localizer.on_scan(replace(scan_from(START, 0), sensor="rear"))
    assert belief_after(localizer, 24, step).updated == 24
    localizer.on_odometry(odometry(25, step))
    localizer.on_scan(replace(scan_from(START.compose(step), 25), sensor="rear"))
    assert localizer.belief.updated == 25
    localizer.on_odometry(odometry(26, step))
    localizer.on_scan(replace(scan_from(START.compose(step), 26), sensor="rear"))
    assert localizer.belief.updated == 25


def test_a_scan_waits_for_the_odometry_of_its_tick() -> None:
    """The order of the readings of a beat has no effect."""
    odometry_first, scan_first = started_localizer(), started_localizer()
    expected = belief_after(odometry_first, 24, Pose2(0.3, 0, 0.1))
    scan_first.on_scan(scan_from(START.compose(Pose2(0.3, 0, 0.1)), 24))
    assert scan_first.belief.updated == 0
    scan_first.on_odometry(odometry(24, Pose2(0.3, 0, 0.1)))
    assert scan_first.belief.pose == expected.pose
    assert np.array_equal(scan_first.belief.particles, expected.particles)


def test_late_scan_updates_the_pose_of_its_measurement() -> None:
    punctual, delayed = started_localizer(), started_localizer()
    steps = [(24, Pose2(0.3, 0, 0)), (48, Pose2(0.6, 0, 0.3))]
    for tick, step in steps:
        punctual.on_odometry(odometry(tick, step))
        delayed.on_odometry(odometry(tick, step))
        if tick == 24:
            punctual.on_scan(scan_from(START.compose(step), tick))
    delayed.on_scan(scan_from(START.compose(steps[0][1]), 24))
    assert delayed.belief.pose == pytest.approx(punctual.belief.pose)


def test_scans_older_than_all_odometry_are_ignored() -> None:
    localizer = build_localizer(Amcl(), GUESS, 1)
    localizer.on_odometry(odometry(100, Pose2(0, 0, 0)))
    localizer.on_scan(scan_from(START, 50))
    assert localizer.belief.updated == 0


def test_number_of_particles_decreases_from_maximum_to_minimum() -> None:
    spec = Amcl(min_particles=100, max_particles=3000, laser_model_type="likelihood_field_prob")
    localizer = build_localizer(spec, GUESS, 1)
    assert len(localizer.belief.particles) == 3000
    for tick, row in enumerate(drive(20.0).truth[::20]):
        localizer.on_odometry(odometry(tick, Pose2(*drive(20.0).truth[0]).between(Pose2(*row))))
        localizer.on_scan(scan_from(Pose2(*row), tick))
    assert 100 <= len(localizer.belief.particles) < 200


def weights_after(spec: Amcl, updates: int) -> np.ndarray:
    localizer = started_localizer(spec)
    for k in range(1, updates):
        belief_after(localizer, 24 * k, Pose2(0.3 * (k % 2), 0, 0))
    return localizer.belief.particles[:, 3]


@pytest.mark.parametrize(("updates", "is_resampled"), [(1, False), (2, False), (3, True), (4, False)])
def test_resampling_happens_at_the_resample_interval(updates: int, is_resampled: bool) -> None:
    assert (np.ptp(weights_after(Amcl(resample_interval=3), updates)) == 0) == is_resampled


def test_selective_resampling_waits_until_less_than_half_of_the_particles_are_effective() -> None:
    weights = weights_after(Amcl(selective_resampling=True, laser_model_type="likelihood_field"), 1)
    assert np.ptp(weights) > 0
    assert 1 / (weights @ weights) > len(weights) / 2
    spec = Amcl(selective_resampling=True, laser_model_type="likelihood_field_prob")
    assert np.ptp(weights_after(spec, 1)) == 0


@pytest.mark.parametrize("ranges", [np.full(BEAMS, np.nan), np.full(BEAMS, np.inf), np.full(BEAMS, -3.0), np.empty(0)])
def test_particles_spread_with_odometry_while_the_lidar_is_blind(ranges: np.ndarray) -> None:
    localizer = started_localizer()
    for k in range(1, 20):
        localizer.on_odometry(odometry(24 * k, Pose2(0.3 * k, 0, 0)))
        localizer.on_scan(scan(ranges, 24 * k))
    blind_belief, first_belief = localizer.belief, started_localizer().belief
    assert blind_belief.map_from_odom == pytest.approx(first_belief.map_from_odom)
    assert blind_belief.updated == 0
    assert np.trace(blind_belief.covariance) > 5 * np.trace(first_belief.covariance)


def test_scan_that_fits_no_particle_gives_equal_weights() -> None:
    """With z_rand = 0 and a small sigma_hit, the probability of each particle is zero."""
    spec = Amcl(laser_model_type="likelihood_field_prob", z_rand=0.0, sigma_hit=0.01, recovery_alpha_slow=0.001,
                recovery_alpha_fast=0.1)  # fmt: skip
    localizer = started_localizer(spec, range_max=5.0)
    localizer.on_odometry(odometry(24, Pose2(0.3, 0, 0)))
    localizer.on_scan(scan(np.random.default_rng(1).uniform(0.2, 4, BEAMS), 24))
    belief = localizer.belief
    assert np.isfinite(belief.covariance).all()
    assert np.ptp(belief.particles[:, 3]) == 0


def test_vanishing_weights_become_equal() -> None:
    """Without resampling, the product of the probabilities of many scans is smaller than the smallest float."""
    spec = Amcl(laser_model_type="likelihood_field_prob", z_rand=1e-6, sigma_hit=0.02, resample_interval=100)
    localizer = started_localizer(spec)
    for k in range(1, 60):
        belief = belief_after(localizer, 24 * k, Pose2(0.3 * (k % 2), 0, 0))
        assert np.isfinite(belief.covariance).all()
        assert belief.particles[:, 3].sum() == pytest.approx(1)


def test_reset_uses_the_next_odometry_as_the_new_reference() -> None:
    localizer = started_localizer()
    belief_after(localizer, 24, Pose2(0.3, 0, 0))
    localizer.reset(Estimate(Pose2(1, 1, 1), (0.1, 0.2, 0.3)))
    assert localizer.belief.pose == Pose2(1, 1, 1)
    assert np.allclose(localizer.belief.covariance, np.diag([0.01, 0.04, 0.09]))
    localizer.on_odometry(odometry(3, Pose2(7, 7, 7)))
    assert localizer.belief.pose == pytest.approx((1, 1, 1))


def test_particles_cover_the_free_space_without_an_estimate() -> None:
    belief = build_localizer(Amcl(), Estimate(None), 1).belief
    assert (grid().values_at(belief.particles[:, :2]) == 0).all()
    assert np.sqrt(np.diag(belief.covariance)).min() > 1


def test_rotated_map_gives_the_same_result() -> None:
    """The cells of the rotated map have other borders, so the result is only approximately equal."""
    unrotated, rotation = surroundings().map, Pose2(3.0, -2.0, 0.7)
    assert unrotated is not None
    rotated_surroundings = replace(surroundings(), map=replace(unrotated, origin=rotation.compose(unrotated.origin)))
    start = Estimate(rotation.compose(Pose2(-2.3, -1.9, 0.5)), (0.3, 0.3, 0.2))
    localizer = amcl(Amcl(), Setting(rotated_surroundings, "localizer", Streams(1), estimate=start))
    localizer.on_odometry(odometry(0, Pose2(0, 0, 0)))
    localizer.on_scan(scan_from(START, 0))
    error = rotation.compose(START).between(localizer.belief.pose)
    assert np.hypot(error.x, error.y) < 0.1


@pytest.mark.parametrize("kind", ["likelihood_field", "likelihood_field_prob", "beam"])
@pytest.mark.parametrize("max_range", [-1.0, 0.0])
def test_unset_maximum_range_is_that_of_the_lidar(kind: str, max_range: float) -> None:
    """As in nav2_amcl, laser_max_range has no effect unless it is positive."""
    without_limit, with_limit = (
        started_localizer(
            Amcl.model_validate({"laser_model_type": kind, "max_particles": 100, "min_particles": 20, **options})
        )
        for options in ({}, {"laser_max_range": max_range})
    )
    assert with_limit.belief.pose == without_limit.belief.pose
    assert belief_after(with_limit, 24, Pose2(0.3, 0, 0)).pose == belief_after(without_limit, 24, Pose2(0.3, 0, 0)).pose


def test_zero_standard_deviation_is_refused() -> None:
    """The square of such a small value is numerically zero."""
    with pytest.raises(ValidationError, match="sigma_hit"):
        Amcl(sigma_hit=1e-30)
