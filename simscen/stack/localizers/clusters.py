"""Pose estimate and covariance from weighted particles."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.stack.localizers.kld import BIN_METERS, BINS_OF_YAW, Keys, bins, join, split
from simscen.stack.localizers.particles import Particles, wrapped

BINS_IN_TOUCH = 8
"""The most that poses fill which are nearer to each other than a bin is wide, in all three coordinates."""
_AROUND = np.array([(x, y, a) for x in (-1, 0, 1) for y in (-1, 0, 1) for a in (-1, 0, 1)])


def clusters(keys: Keys) -> Keys:
    """Labels (n,) of groups of particles whose bins touch, corners and the turn from 350° to 0° included.

    `keys` (n,) are their histogram bins. As pf_kdtree_cluster of nav2_amcl, which overlooks the full turn. A label is
    the rank of the lowest bin of its group. (scipy's connected_components takes 0.3 ms to answer for the few bins of
    a robot that knows where it is, three times as long as all of this.)
    """
    occupied, bin_of = np.unique(keys, return_inverse=True)
    x, y, yaw = split(occupied)
    wanted = join(x + _AROUND[:, :1], y + _AROUND[:, 1:2], (yaw + _AROUND[:, 2:]) % BINS_OF_YAW)
    found = np.minimum(np.searchsorted(occupied, wanted), len(occupied) - 1)
    itself = np.arange(len(occupied))
    neighbors, labels = np.where(occupied[found] == wanted, found, itself), itself
    while True:
        lowest = labels[neighbors].min(axis=0)
        if np.array_equal(lowest, labels):
            return labels[bin_of]
        labels = lowest[lowest]


def summarize(particles: Particles, peak: float = 1.0) -> tuple[Pose2, Array]:
    """Where the particles say the robot is, and the covariance (3, 3) of *all* particles about that pose.

    The pose is that of the heaviest cluster. nav2_amcl takes its mean, which lags behind a moving robot where weights
    are as flat as those of its default sensor model. The best particle does not lag, but jumps when another one takes
    its place, by as much as the cluster is wide. Here the weights to the power `peak` (the sensor model's; 1 leaves
    the mean) are averaged, too, and the two means count in inverse proportion to their variances: where the best
    particles agree it is theirs, where they do not it stays in the middle, and it changes smoothly with the weights.
    All of this was measured (docs/reference/localizers.md).

    The covariance is that of all particles, as in nav2_amcl, so that a second cluster shows. It is taken about the
    reported pose, which makes it the expected squared error of that pose, and it holds the products of place and
    heading too, which nav2_amcl leaves zero. Headings are averaged on the circle.
    """
    poses, weights = particles.poses, particles.weights
    if not in_touch(particles):
        labels = clusters(bins(poses))
        heaviest = labels == np.bincount(labels, weights=weights).argmax()
        poses, weights = poses[heaviest], weights[heaviest]
    elif peak == 1.0:
        return _together(particles)
    mean = _mean(poses, weights)
    if peak == 1.0:
        return mean, spread(particles, mean)
    peaked = (weights / weights.max()) ** peak
    best = _mean(poses, peaked)
    width, narrower = _width(poses, weights, mean), _width(poses, peaked, best)
    towards = width / (width + narrower) if narrower > 0 else 1.0
    turned = mean.yaw + towards * wrap(best.yaw - mean.yaw)
    pose = Pose2(mean.x + towards * (best.x - mean.x), mean.y + towards * (best.y - mean.y), wrap(turned))
    return pose, spread(particles, pose)


def _together(particles: Particles) -> tuple[Pose2, Array]:
    """The same of particles that are in touch, all sums in one product: of those headings are as good as numbers."""
    first: tuple[float, float, float] = tuple(particles.poses[0].tolist())
    off = np.ones((4, len(particles.weights)))
    np.subtract(particles.poses.T, np.array([first]).T, off[:3])
    off[2] = wrapped(off[2])
    (xx, xy, xa, x), (_, yy, ya, y), (_, _, aa, a), (*_, total) = np.dot(off * particles.weights, off.T).tolist()
    dx, dy, turn = x / total, y / total, a / total
    xy, xa, ya = xy - dx * y, xa - dx * a, ya - dy * a
    pose = Pose2(first[0] + dx, first[1] + dy, wrap(first[2] + turn))
    return pose, np.array(((xx - dx * x, xy, xa), (xy, yy - dy * y, ya), (xa, ya, aa - turn * a)))


def in_touch(particles: Particles) -> bool:
    """Whether they are so near to each other that their bins touch, whichever these are."""
    x, y, yaw = particles.extent
    return x < BIN_METERS and y < BIN_METERS and yaw < 2 * math.pi / BINS_OF_YAW


def _mean(poses: Array, weights: Array) -> Pose2:
    """The mean of poses (n, 3) by weights (n,)."""
    total, yaw = float(np.add.reduce(weights)), poses[:, 2]
    x, y = (weights @ poses[:, :2]).tolist()
    return Pose2(x / total, y / total, math.atan2(weights @ np.sin(yaw), weights @ np.cos(yaw)))


def _width(poses: Array, weights: Array, mean: Pose2) -> float:
    """The variance of the places of poses (n, 3) by weights (n,) about their mean, in m²."""
    return float(weights @ np.square(poses[:, :2] - mean[:2]).sum(axis=1) / weights.sum())


def spread(particles: Particles, pose: Pose2) -> Array:
    """The expected squared error (3, 3) of `pose`, if the particles are right."""
    error = errors_about(np.array(pose), particles.poses).T
    covariance: Array = (error * particles.weights) @ error.T
    return covariance


def errors_about(pose: Array, poses: Array) -> Array:
    """What `poses` (n, 3) differ by from `pose` (3,), headings wrapped."""
    error = poses - pose
    error[:, 2] = wrapped(error[:, 2])
    return error
