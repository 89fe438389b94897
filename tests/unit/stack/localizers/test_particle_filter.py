"""How particles move where scans and wheels tell different ways."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.localization import Estimate
from simscen.model.localizers import Amcl
from simscen.stack.localizers.build import matching
from simscen.stack.localizers.motion_models import Differential
from simscen.stack.localizers.particle_filter import BELIEVE_WHEELS, ParticleFilter
from simscen.stack.localizers.scan_matcher import Step
from simscen.testing.room import grid


def followed(seen: Pose2, odometry: Pose2) -> Array:
    """Poses (n, 3) of particles that were at the origin, all of them."""
    known = matching(grid(), Amcl())
    motion, chance = Differential((0.2, 0.2, 0.2, 0.2)), np.random.default_rng(1)
    particles = ParticleFilter(Amcl(), motion, known.sensor, known.anywhere, chance)
    particles.begin(Estimate(Pose2(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    particles.follow(Step(seen, np.diag(np.square((0.01, 0.01, 0.005)))), odometry)
    return particles.particles.poses


def test_some_particles_get_as_far_as_the_wheels_say_where_people_seem_to_hold_the_robot_back() -> None:
    poses = followed(Pose2(0.0, 0.0, 0.0), Pose2(0.25, 0.0, 0.0))
    as_far = np.abs(poses[:, 0] - 0.25) < 0.05
    assert abs(as_far.mean() - BELIEVE_WHEELS) < 0.05
    assert (np.abs(poses[~as_far, 0]) < 0.05).all()


def test_none_turns_as_wheels_say_that_slip_where_walls_show_how_the_robot_turned() -> None:
    """The fifth that did found rooms that had been rebuilt, and fitted by chance so turned."""
    poses = followed(Pose2(0.0, 0.0, 0.3), Pose2(0.0, 0.0, 0.5))
    assert (np.abs(poses[:, 2] - 0.3) < 0.03).all()
