"""Tests of the particle filter with scan matching: motion of the particles, and random particles."""

import numpy as np
import pytest

from simscen.advanced.localizers.build import map_models
from simscen.advanced.localizers.matched_motion import MatchedMotion
from simscen.advanced.localizers.particle_filter import ODOMETRY_SHARE, ScanMatchingParticleFilter
from simscen.advanced.spec import ScanMatchingAmcl
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Estimate
from simscen.stack.localizers.motion_models import DifferentialMotionModel
from simscen.testing.synthetic_room import BEAMS, cast, grid, scan

START, ELSEWHERE = Pose2(-2.5, -1.8, 0.6), Pose2(3.9, -0.2, 2.4)


def particles_after(scan_matching: Pose2, odometry: Pose2) -> Array:
    """Return the poses (n, 3) of particles that start at the origin, after the motion measured by both sources."""
    spec = ScanMatchingAmcl()
    models, motion = map_models(grid(), spec), DifferentialMotionModel((0.2, 0.2, 0.2, 0.2))
    pf = ScanMatchingParticleFilter(spec, motion, models.sensor, models.free_space, np.random.default_rng(1))
    pf.reset(Estimate(Pose2(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    pf.move_by_scan_matching(MatchedMotion(scan_matching, np.diag(np.square((0.01, 0.01, 0.005)))), odometry)
    return pf.particles.poses


def test_some_particles_follow_odometry_if_scans_show_no_motion() -> None:
    """To scan matching, people who walk next to the robot look like static surroundings."""
    poses = particles_after(Pose2(0.0, 0.0, 0.0), Pose2(1.0, 0.0, 0.0))
    follows_odometry = np.hypot(poses[:, 0], poses[:, 1]) > 0.1
    assert abs(follows_odometry.mean() - ODOMETRY_SHARE) < 0.05


def test_some_particles_rotate_with_odometry_if_scan_matching_disagrees() -> None:
    poses = particles_after(Pose2(0.0, 0.0, 0.3), Pose2(0.0, 0.0, 0.5))
    follows_odometry = np.abs(poses[:, 2] - 0.3) > 0.03
    assert abs(follows_odometry.mean() - ODOMETRY_SHARE) < 0.05
    assert 0.4 < np.median(poses[follows_odometry, 2]) < 0.6


@pytest.mark.parametrize(("relocalization", "stay_together"), [("scan_matching", True), ("random", False)])
def test_only_random_relocalization_adds_random_particles_when_scans_no_longer_fit(
    relocalization: str, stay_together: bool
) -> None:
    spec = ScanMatchingAmcl.model_validate({
        "relocalization": relocalization, "recovery_alpha_slow": 0.01, "recovery_alpha_fast": 0.5,
        "map_trust_full": 0.0, "settling_distance": 0.0,
    })  # fmt: skip
    models, motion = map_models(grid(), spec), DifferentialMotionModel((0.2, 0.2, 0.2, 0.2))
    pf = ScanMatchingParticleFilter(spec, motion, models.sensor, models.free_space, np.random.default_rng(1))
    pf.reset(Estimate(START, (0.05, 0.05, 0.02)))
    angles = -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS)
    for pose in [START] * 5 + [ELSEWHERE] * 5:
        pf.correct(scan(cast(np.array([pose]), angles)[0]))
    assert pf.particles.are_within(1.5) is stay_together
