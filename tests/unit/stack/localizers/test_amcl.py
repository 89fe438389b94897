"""AMCL keeps Nav2's rhythm and stays sane whatever its sensors say."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from simscen.core.environment.occupancy_grid import UNKNOWN
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.localization import Belief, Estimate
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.localizers import Amcl
from simscen.stack.localizers.amcl import SURE_AFTER
from simscen.stack.localizers.build import amcl
from simscen.stack.localizers.particle_filter import ParticleFilter
from simscen.stack.protocols import Localizer
from simscen.stack.setting import Setting
from simscen.testing.room import BEAMS, cast, drive, grid, localizer, run, scan, surroundings

START = Pose2(-2.5, -1.8, 0.6)
DEFAULT = Amcl()
GUESS = Estimate(Pose2(-2.3, -1.9, 0.5), (0.3, 0.3, 0.2))


def seen(pose: Pose2, tick: int, **changes: object) -> Scan:
    return scan(cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0], tick, **changes)


def odometry(tick: int, pose: Pose2) -> Odometry:
    return Odometry("odom", tick, pose, Twist())


def started(spec: Amcl = DEFAULT, **changes: object) -> Localizer:
    """A localizer that has had its first odometry and its first scan."""
    subject = localizer(spec, GUESS, 1)
    subject.on_odometry(odometry(0, Pose2(0, 0, 0)))
    subject.on_scan(seen(START, 0, **changes))
    return subject


def moved(subject: Localizer, tick: int, step: Pose2, **changes: object) -> Belief:
    """After an honest step from the start."""
    subject.on_odometry(odometry(tick, step))
    subject.on_scan(seen(START.compose(step), tick, **changes))
    return subject.belief


def test_the_first_scan_corrects_although_nothing_has_moved() -> None:
    error = START.between(started().belief.pose)
    assert np.hypot(error.x, error.y) < 0.1
    assert abs(error.yaw) < 0.06


@pytest.mark.parametrize(
    ("step", "corrects"),
    [(Pose2(0.24, 0, 0.19), False), (Pose2(0.26, 0, 0), True), (Pose2(-0.2, 0.2, 0), True), (Pose2(0, 0, -0.21), True)],
)
def test_a_scan_corrects_only_after_enough_motion(step: Pose2, corrects: bool) -> None:
    belief = moved(started(), 24, step)
    assert belief.updated == (24 if corrects else 0)


SURELY = Amcl(sure_update_interval=2, settling_distance=0.0)
TOLD = Estimate(START, (0.05, 0.05, 0.02))


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Ticks of the scans that are compared with the map."""
    ticks: list[int] = []
    correct = ParticleFilter.correct

    def watched(self: ParticleFilter, scan: Scan) -> tuple[Pose2, Array] | None:
        ticks.append(scan.tick)
        return correct(self, scan)

    monkeypatch.setattr(ParticleFilter, "correct", watched)
    return ticks


@pytest.mark.parametrize("interval", [1, 2, 3])
def test_who_is_sure_compares_one_of_so_many_scans_with_the_map(interval: int, compared: list[int]) -> None:
    driven = drive(20.0)
    spec = SURELY.model_copy(update={"sure_update_interval": interval})
    beliefs = run(localizer(spec, Estimate(Pose2(*driven.truth[0]), TOLD.std), 1), driven, 1)
    looked_at = list(dict.fromkeys(belief.updated for belief in beliefs))
    assert compared == looked_at[: SURE_AFTER + 1] + looked_at[SURE_AFTER + interval :: interval]


@pytest.mark.parametrize(("std", "expected"), [(1.0, [0, 48]), (0.1, [0, 24, 48])])
def test_who_hides_the_room_tells_nothing_to_a_robot_that_may_be_anywhere_about(
    std: float, expected: list[int], compared: list[int]
) -> None:
    """Somebody 0.3 m from the lidar hides half of the room; a robot whose particles are together asks the map."""
    subject = localizer(Amcl(settling_distance=400.0), Estimate(START, (std, std, 0.2)), 1)
    for tick, metres in ((0, 0.0), (24, 0.26), (48, 0.52)):
        there = Pose2(metres, 0.0, 0.0)
        view = seen(START.compose(there), tick)
        if tick == 24:
            view.ranges[: BEAMS // 2] = 0.3
        subject.on_odometry(odometry(tick, there))
        subject.on_scan(view)
    assert compared == expected


def test_a_covariance_of_scatter_is_learned_from_each_scan(compared: list[int]) -> None:
    driven = drive(10.0)
    spec = SURELY.model_copy(update={"covariance": "scatter"})
    beliefs = run(localizer(spec, Estimate(Pose2(*driven.truth[0]), TOLD.std), 1), driven, 1)
    assert compared == list(dict.fromkeys(belief.updated for belief in beliefs))
    assert len(compared) > SURE_AFTER + 4


def turning(subject: Localizer, until: int) -> None:
    for k in range(until):
        moved(subject, 24 * k, Pose2(0.0, 0.0, 0.26 * k))


def test_a_scan_that_is_not_compared_shows_how_far_the_robot_came(compared: list[int]) -> None:
    """Wheels that are 2 cm off are no surprise, and not believed either."""
    subject = localizer(SURELY, TOLD, 1)
    turning(subject, SURE_AFTER + 1)
    before, tick = subject.belief, 24 * (SURE_AFTER + 1)
    said = Pose2(0.0, 0.0, 0.26 * (SURE_AFTER + 1))
    truth = START.compose(said).compose(Pose2(0.02, 0.0, 0.0))
    subject.on_odometry(odometry(tick, said))
    subject.on_scan(seen(truth, tick))
    after = subject.belief
    assert after.updated == tick
    assert tick not in compared
    drifted = truth.between(after.pose), START.compose(Pose2(0.0, 0.0, 0.26 * SURE_AFTER)).between(before.pose)
    assert math.dist(drifted[0][:2], drifted[1][:2]) < 0.008
    assert np.linalg.eigvalsh(after.covariance).min() > 0
    assert np.trace(after.covariance) > np.trace(before.covariance)


def test_who_is_sure_compares_a_scan_at_once_when_the_wheels_slip(compared: list[int]) -> None:
    subject = localizer(SURELY, TOLD, 1)
    turning(subject, SURE_AFTER + 1)
    tick, said = 24 * (SURE_AFTER + 1), Pose2(0.0, 0.0, 0.26 * (SURE_AFTER + 1))
    slipped = said.compose(Pose2(0.3, 0.0, 0.0))
    subject.on_odometry(odometry(tick, said))
    subject.on_scan(seen(START.compose(slipped), tick))
    assert compared[-1] == tick
    assert math.dist(START.compose(slipped)[:2], subject.belief.pose[:2]) < 0.1


@pytest.mark.parametrize("strange_at", [SURE_AFTER + 3, SURE_AFTER + 4])
def test_after_a_scan_that_does_not_show_the_map_each_is_compared(strange_at: int, compared: list[int]) -> None:
    subject = localizer(SURELY, TOLD, 1)
    for k in range(SURE_AFTER + 10):
        step = Pose2(0.0, 0.0, 0.26 * k)
        here = seen(START.compose(step), 24 * k)
        subject.on_odometry(odometry(24 * k, step))
        subject.on_scan(replace(here, ranges=np.full_like(here.ranges, 1.2)) if k == strange_at else here)
    numbers = [tick // 24 for tick in compared]
    sure = [k for k in range(SURE_AFTER + 1, strange_at) if (k - SURE_AFTER) % 2]
    assert numbers == [k for k in range(SURE_AFTER + 10) if k not in sure]


def test_between_corrections_odometry_carries_the_pose_and_uncertainty_grows() -> None:
    subject = started()
    before = subject.belief
    subject.on_odometry(odometry(6, Pose2(0.1, 0.02, 0.05)))
    after = subject.belief
    assert after.pose == pytest.approx(before.pose.compose(Pose2(0.1, 0.02, 0.05)))
    assert after.map_from_odom == before.map_from_odom
    assert np.linalg.eigvalsh(after.covariance - before.covariance).max() > 0
    assert np.trace(after.covariance) > np.trace(before.covariance)


def test_each_lidar_corrects_once_after_enough_motion() -> None:
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


def test_a_scan_that_arrives_late_corrects_the_pose_at_which_it_was_taken() -> None:
    punctual, delayed = started(), started()
    steps = [(24, Pose2(0.3, 0, 0)), (48, Pose2(0.6, 0, 0.3))]
    for tick, step in steps:
        punctual.on_odometry(odometry(tick, step))
        delayed.on_odometry(odometry(tick, step))
        if tick == 24:
            punctual.on_scan(seen(START.compose(step), tick))
    delayed.on_scan(seen(START.compose(steps[0][1]), 24))
    assert delayed.belief.pose == pytest.approx(punctual.belief.pose)


def test_where_there_is_no_map_the_pose_follows_what_the_scans_show_and_not_wheels_that_slip() -> None:
    unknown = replace(grid(), cells=np.full_like(grid().cells, UNKNOWN))
    subject = amcl(Amcl(), Setting(replace(surroundings(), map=unknown), "localizer", Streams(1)))
    subject.reset(Estimate(START, (0.01, 0.01, 0.01)))
    for k in range(8):
        subject.on_odometry(odometry(24 * k, Pose2(0.3 * k, 0.03 * k, 0.04 * k)))
        subject.on_scan(seen(START.compose(Pose2(0.26 * k, 0.0, 0.0)), 24 * k))
    off = START.compose(Pose2(0.26 * 7, 0.0, 0.0)).between(subject.belief.pose)
    assert np.hypot(off.x, off.y) < 0.06
    assert abs(off.yaw) < 0.03


def test_the_first_scan_counts_little_beside_what_was_told() -> None:
    settling, at_once = (started(Amcl(settling_distance=metres)).belief for metres in (4.0, 0.0))
    assert np.trace(settling.covariance) > 1.5 * np.trace(at_once.covariance)
    assert np.hypot(*(np.array(START) - settling.pose)[:2]) < 0.2


def test_scans_older_than_any_odometry_are_left_alone() -> None:
    subject = localizer(Amcl(), GUESS, 1)
    subject.on_odometry(odometry(100, Pose2(0, 0, 0)))
    subject.on_scan(seen(START, 50))
    assert subject.belief.updated == 0


def test_the_particles_start_at_the_most_and_shrink_to_the_least_as_the_place_becomes_certain() -> None:
    spec = Amcl(min_particles=100, max_particles=3000, laser_model_type="likelihood_field_prob")
    subject = localizer(spec, GUESS, 1)
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
def test_resampling_happens_on_every_interval_only(updates: int, equal: bool) -> None:
    assert (np.ptp(weights_after(Amcl(resample_interval=3), updates)) == 0) == equal


def test_selective_resampling_waits_until_half_of_the_particles_carry_no_weight() -> None:
    patient = weights_after(Amcl(selective_resampling=True, laser_model_type="likelihood_field"), 1)
    assert np.ptp(patient) > 0
    assert 1 / (patient @ patient) > len(patient) / 2
    sharp = Amcl(selective_resampling=True, laser_model_type="likelihood_field_prob")
    assert np.ptp(weights_after(sharp, 1)) == 0


@pytest.mark.parametrize("ranges", [np.full(BEAMS, np.nan), np.full(BEAMS, np.inf), np.full(BEAMS, -3.0), np.empty(0)])
def test_a_blind_lidar_moves_nothing_and_the_particles_spread_as_odometry_drifts(ranges: np.ndarray) -> None:
    subject = started()
    for k in range(1, 20):
        subject.on_odometry(odometry(24 * k, Pose2(0.3 * k, 0, 0)))
        subject.on_scan(scan(ranges, 24 * k))
    blind, sighted = subject.belief, started().belief
    assert blind.map_from_odom == pytest.approx(sighted.map_from_odom)
    assert blind.updated == 0
    assert np.trace(blind.covariance) > 5 * np.trace(sighted.covariance)


def test_a_scan_that_no_particle_can_explain_leaves_them_equally_likely() -> None:
    """With z_rand = 0 and a narrow hit every particle off the walls has probability zero."""
    spec = Amcl(laser_model_type="likelihood_field_prob", z_rand=0.0, sigma_hit=0.01, recovery_alpha_slow=0.001,
                recovery_alpha_fast=0.1)  # fmt: skip
    subject = started(spec, range_max=5.0)
    subject.on_odometry(odometry(24, Pose2(0.3, 0, 0)))
    subject.on_scan(scan(np.random.default_rng(1).uniform(0.2, 4, BEAMS), 24))
    belief = subject.belief
    assert np.isfinite(belief.covariance).all()
    assert np.ptp(belief.particles[:, 3]) == 0


def test_weights_that_vanish_between_two_draws_are_made_equal_again() -> None:
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


def test_without_an_estimate_the_particles_lie_all_over_the_free_space() -> None:
    belief = localizer(Amcl(), Estimate(None), 1).belief
    assert (grid().values_at(belief.particles[:, :2]) == 0).all()
    assert np.sqrt(np.diag(belief.covariance)).min() > 1


def test_a_map_that_is_turned_changes_nothing() -> None:
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
def test_no_greatest_range_is_the_lidars_own(kind: str, farthest: float) -> None:
    """As in nav2_amcl, where only what is above zero cuts ranges."""
    usual, subject = (
        started(Amcl.model_validate({"laser_model_type": kind, "max_particles": 100, "min_particles": 20, **said}))
        for said in ({}, {"laser_max_range": farthest})
    )
    assert subject.belief.pose == usual.belief.pose
    assert moved(subject, 24, Pose2(0.3, 0, 0)).pose == moved(usual, 24, Pose2(0.3, 0, 0)).pose


def test_a_standard_deviation_of_nothing_is_not_accepted() -> None:
    """Its square would be zero."""
    with pytest.raises(ValidationError, match="sigma_hit"):
        Amcl(sigma_hit=1e-30)
