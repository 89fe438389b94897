"""Tests of how particles move when scan matching and odometry disagree."""

import numpy as np

from simscen.advanced.localizers.build import map_models
from simscen.advanced.localizers.particle_filter import ODOMETRY_SHARE, ScanMatchingParticleFilter
from simscen.advanced.localizers.scan_matcher import Step
from simscen.advanced.localizers.spec import ScanMatchingAmcl
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Estimate
from simscen.stack.localizers.motion_models import DifferentialMotionModel
from simscen.testing.synthetic_room import grid


def poses_after(scan_matching: Pose2, odometry: Pose2) -> Array:
    """Return the poses (n, 3) of particles that all started at the origin."""
    spec = ScanMatchingAmcl()
    models, motion = map_models(grid(), spec), DifferentialMotionModel((0.2, 0.2, 0.2, 0.2))
    subject = ScanMatchingParticleFilter(spec, motion, models.sensor, models.free_space, np.random.default_rng(1))
    subject.begin(Estimate(Pose2(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    subject.follow(Step(scan_matching, np.diag(np.square((0.01, 0.01, 0.005)))), odometry)
    return subject.particles.poses


def test_some_particles_translate_as_odometry_says_where_scans_show_no_motion() -> None:
    """People who walk beside a robot look like a room that moves with it."""
    poses = poses_after(Pose2(0.0, 0.0, 0.0), Pose2(0.25, 0.0, 0.0))
    by_odometry = np.abs(poses[:, 0] - 0.25) < 0.05
    assert abs(by_odometry.mean() - ODOMETRY_SHARE) < 0.05
    assert (np.abs(poses[~by_odometry, 0]) < 0.05).all()


def test_all_particles_rotate_as_the_scans_show() -> None:
    poses = poses_after(Pose2(0.0, 0.0, 0.3), Pose2(0.0, 0.0, 0.5))
    assert (np.abs(poses[:, 2] - 0.3) < 0.03).all()
