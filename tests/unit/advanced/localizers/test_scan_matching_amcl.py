"""Tests of AMCL with scan matching: scans that are not compared with the map, unknown space, and initial pose."""

import math
from dataclasses import replace

import numpy as np
import pytest

from simscen.advanced.localizers.build import scan_matching_amcl
from simscen.advanced.localizers.scan_matching_amcl import CERTAIN_AFTER_UPDATES
from simscen.advanced.spec import ScanMatchingAmcl
from simscen.core.environment.occupancy_grid import UNKNOWN
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.stack.localizers.particle_filter import ParticleFilter
from simscen.stack.protocols import Localizer
from simscen.stack.setting import Setting
from simscen.testing.synthetic_room import BEAMS, build_localizer, cast, drive, grid, run_localizer, scan, surroundings

START = Pose2(-2.5, -1.8, 0.6)
GUESS = Estimate(Pose2(-2.3, -1.9, 0.5), (0.3, 0.3, 0.2))
SKIPPING = ScanMatchingAmcl(sure_update_interval=2, settling_distance=0.0)
"""Compares only every second scan with the map while the pose is certain."""
KNOWN = Estimate(START, (0.05, 0.05, 0.02))


def scan_from(pose: Pose2, tick: int) -> Scan:
    return scan(cast(np.array([pose]), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS))[0], tick)


def odometry(tick: int, pose: Pose2) -> Odometry:
    return Odometry("odom", tick, pose, Twist())


def started_localizer(spec: ScanMatchingAmcl) -> Localizer:
    """Return a localizer that has received its first odometry and its first scan."""
    localizer = build_localizer(spec, GUESS, 1)
    localizer.on_odometry(odometry(0, Pose2(0, 0, 0)))
    localizer.on_scan(scan_from(START, 0))
    return localizer


def belief_after(localizer: Localizer, tick: int, step: Pose2) -> Belief:
    """Return the belief after a step from the start with exact odometry."""
    localizer.on_odometry(odometry(tick, step))
    localizer.on_scan(scan_from(START.compose(step), tick))
    return localizer.belief


@pytest.fixture
def compared_ticks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the ticks of the scans that are compared with the map."""
    ticks: list[int] = []
    correct = ParticleFilter.correct

    def recording_correct(self: ParticleFilter, scan: Scan) -> tuple[Pose2, Array] | None:
        ticks.append(scan.tick)
        return correct(self, scan)

    monkeypatch.setattr(ParticleFilter, "correct", recording_correct)
    return ticks


@pytest.mark.parametrize("interval", [1, 2, 3])
def test_a_certain_robot_compares_every_nth_scan_with_the_map(interval: int, compared_ticks: list[int]) -> None:
    log = drive(20.0)
    spec = SKIPPING.model_copy(update={"sure_update_interval": interval})
    beliefs = run_localizer(build_localizer(spec, Estimate(Pose2(*log.truth[0]), KNOWN.std), 1), log, 1)
    updates = list(dict.fromkeys(belief.updated for belief in beliefs))
    assert (
        compared_ticks == updates[: CERTAIN_AFTER_UPDATES + 1] + updates[CERTAIN_AFTER_UPDATES + interval :: interval]
    )


@pytest.mark.parametrize("std", [1.0, 0.1])
def test_a_scan_that_overlaps_little_is_compared_with_the_map(std: float, compared_ticks: list[int]) -> None:
    """A robot with an uncertain pose needs each scan, above all where consecutive scans overlap little."""
    localizer = build_localizer(ScanMatchingAmcl(settling_distance=400.0), Estimate(START, (std, std, 0.2)), 1)
    for tick, meters in ((0, 0.0), (24, 0.26), (48, 0.52)):
        base = Pose2(meters, 0.0, 0.0)
        view = scan_from(START.compose(base), tick)
        if tick == 24:
            view.ranges[: BEAMS // 2] = 0.3
        localizer.on_odometry(odometry(tick, base))
        localizer.on_scan(view)
    assert compared_ticks == [0, 24, 48]


def test_covariance_estimation_compares_every_scan(compared_ticks: list[int]) -> None:
    log = drive(10.0)
    spec = SKIPPING.model_copy(update={"covariance": "scatter"})
    beliefs = run_localizer(build_localizer(spec, Estimate(Pose2(*log.truth[0]), KNOWN.std), 1), log, 1)
    assert compared_ticks == list(dict.fromkeys(belief.updated for belief in beliefs))
    assert len(compared_ticks) > CERTAIN_AFTER_UPDATES + 4


def turn_in_place(localizer: Localizer, scans: int) -> None:
    for k in range(scans):
        belief_after(localizer, 24 * k, Pose2(0.0, 0.0, 0.26 * k))


def test_a_skipped_scan_still_measures_the_motion(compared_ticks: list[int]) -> None:
    """Odometry with an error of 2 cm neither counts as disagreement nor moves the pose."""
    localizer = build_localizer(SKIPPING, KNOWN, 1)
    turn_in_place(localizer, CERTAIN_AFTER_UPDATES + 1)
    before, tick = localizer.belief, 24 * (CERTAIN_AFTER_UPDATES + 1)
    reported = Pose2(0.0, 0.0, 0.26 * (CERTAIN_AFTER_UPDATES + 1))
    truth = START.compose(reported).compose(Pose2(0.02, 0.0, 0.0))
    localizer.on_odometry(odometry(tick, reported))
    localizer.on_scan(scan_from(truth, tick))
    after = localizer.belief
    assert after.updated == tick
    assert tick not in compared_ticks
    errors = (
        truth.between(after.pose),
        START.compose(Pose2(0.0, 0.0, 0.26 * CERTAIN_AFTER_UPDATES)).between(before.pose),
    )
    assert math.dist(errors[0][:2], errors[1][:2]) < 0.008
    assert np.linalg.eigvalsh(after.covariance).min() > 0
    assert np.trace(after.covariance) > np.trace(before.covariance)


def test_next_scan_is_compared_with_the_map_when_wheels_slip(compared_ticks: list[int]) -> None:
    localizer = build_localizer(SKIPPING, KNOWN, 1)
    turn_in_place(localizer, CERTAIN_AFTER_UPDATES + 1)
    tick, reported = 24 * (CERTAIN_AFTER_UPDATES + 1), Pose2(0.0, 0.0, 0.26 * (CERTAIN_AFTER_UPDATES + 1))
    true_motion = reported.compose(Pose2(0.3, 0.0, 0.0))
    localizer.on_odometry(odometry(tick, reported))
    localizer.on_scan(scan_from(START.compose(true_motion), tick))
    assert compared_ticks[-1] == tick
    assert math.dist(START.compose(true_motion)[:2], localizer.belief.pose[:2]) < 0.1


@pytest.mark.parametrize("misfit_at", [CERTAIN_AFTER_UPDATES + 3, CERTAIN_AFTER_UPDATES + 4])
def test_no_scan_is_skipped_after_one_that_does_not_fit_the_map(misfit_at: int, compared_ticks: list[int]) -> None:
    localizer = build_localizer(SKIPPING, KNOWN, 1)
    for k in range(CERTAIN_AFTER_UPDATES + 10):
        step = Pose2(0.0, 0.0, 0.26 * k)
        view = scan_from(START.compose(step), 24 * k)
        localizer.on_odometry(odometry(24 * k, step))
        localizer.on_scan(replace(view, ranges=np.full_like(view.ranges, 1.2)) if k == misfit_at else view)
    compared_indices = [tick // 24 for tick in compared_ticks]
    skipped = [k for k in range(CERTAIN_AFTER_UPDATES + 1, misfit_at) if (k - CERTAIN_AFTER_UPDATES) % 2]
    assert compared_indices == [k for k in range(CERTAIN_AFTER_UPDATES + 10) if k not in skipped]


def test_in_unknown_space_the_pose_follows_the_scans_and_not_slipping_wheels() -> None:
    unknown = replace(grid(), cells=np.full_like(grid().cells, UNKNOWN))
    localizer = scan_matching_amcl(
        ScanMatchingAmcl(), Setting(replace(surroundings(), map=unknown), "localizer", Streams(1))
    )
    localizer.reset(Estimate(START, (0.01, 0.01, 0.01)))
    for k in range(8):
        localizer.on_odometry(odometry(24 * k, Pose2(0.3 * k, 0.03 * k, 0.04 * k)))
        localizer.on_scan(scan_from(START.compose(Pose2(0.26 * k, 0.0, 0.0)), 24 * k))
    error = START.compose(Pose2(0.26 * 7, 0.0, 0.0)).between(localizer.belief.pose)
    assert np.hypot(error.x, error.y) < 0.06
    assert abs(error.yaw) < 0.03


def test_the_first_scan_has_less_weight_than_the_initial_pose_while_settling() -> None:
    settling, without_settling = (
        started_localizer(ScanMatchingAmcl(settling_distance=meters)).belief for meters in (4.0, 0.0)
    )
    assert np.trace(settling.covariance) > 1.5 * np.trace(without_settling.covariance)
    assert np.hypot(*(np.array(START) - settling.pose)[:2]) < 0.2
