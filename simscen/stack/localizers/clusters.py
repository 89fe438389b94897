"""One pose and one covariance out of many particles."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.stack.localizers.kld import BINS_OF_YAW, Keys, bins, join, split
from simscen.stack.localizers.particles import Particles

# Half of the 26 neighbours of a bin; the other half sees it from the other side.
_AHEAD = np.array([(x, y, a) for x in (0, 1) for y in (-1, 0, 1) for a in (-1, 0, 1) if (x, y, a) > (0, 0, 0)])


def clusters(keys: Keys) -> npt.NDArray[np.int64]:
    """Labels (n,) of groups of particles whose bins touch, corners and the turn from 350° to 0° included.

    `keys` (n,) are their histogram bins. As pf_kdtree_cluster of nav2_amcl, which overlooks the full turn.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    occupied, bin_of = np.unique(keys, return_inverse=True)
    x, y, yaw = split(occupied)
    ahead = join(x + _AHEAD[:, :1], y + _AHEAD[:, 1:2], (yaw + _AHEAD[:, 2:]) % BINS_OF_YAW)
    found = np.minimum(np.searchsorted(occupied, ahead), len(occupied) - 1)
    _, here = touching = np.nonzero(occupied[found] == ahead)
    links = coo_array((np.ones(len(here)), (here, found[touching])), shape=(len(occupied), len(occupied)))
    labels = connected_components(links, directed=False)[1].astype(np.int64)
    return labels[bin_of]


def summarise(particles: Particles) -> tuple[Pose2, Array]:
    """The mean pose of the heaviest cluster, and the covariance (3, 3) of *all* particles about that pose.

    nav2_amcl reports the same pair, so that a second cluster shows as a large covariance. Here the covariance is
    taken about the reported pose, which makes it the expected squared error of that pose, and it holds the products
    of place and heading too, which nav2_amcl leaves zero. Headings are averaged on the circle.
    """
    labels = clusters(bins(particles.poses))
    heaviest = labels == np.bincount(labels, weights=particles.weights).argmax()
    poses, weights = particles.poses[heaviest], particles.weights[heaviest]
    x, y = weights @ poses[:, :2] / weights.sum()
    yaw = np.arctan2(weights @ np.sin(poses[:, 2]), weights @ np.cos(poses[:, 2]))
    error = particles.poses - (x, y, yaw)
    error[:, 2] = wrap_array(error[:, 2])
    return Pose2(float(x), float(y), float(yaw)), (error.T * particles.weights) @ error
